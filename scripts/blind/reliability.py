"""How far told probabilities hold: bins, expected calibration error, and the reliability diagram (Guo et al. 2017, ICML, section 2)."""
from __future__ import annotations

from score import wilson

# Narrow where it matters: what is told at 90 % and more sends a mechanic to the machine.
EDGES = (0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)


def table(pairs) -> dict:
    """Bins of (probability, right or not): n, mean probability told, share right with its Wilson interval; ece weighs |told - right| by n."""
    bins, error = [], 0.0
    for low, high in zip(EDGES, EDGES[1:]):
        inside = [(p, bool(ok)) for p, ok in pairs if low <= p < high or (high == 1.0 and p == 1.0)]
        if not inside:
            continue
        told, right = sum(p for p, _ in inside) / len(inside), sum(ok for _, ok in inside) / len(inside)
        error += len(inside) * abs(told - right)
        bins.append({"from": low, "to": high, "n": len(inside), "told": told, "right": right,
                     "wilson": list(wilson(sum(ok for _, ok in inside), len(inside)))})
    return {"n": len(pairs), "ece": error / len(pairs) if pairs else None, "bins": bins}


def percent_of(t: dict) -> str:
    """The calibration error of a table, and of how many causes it is."""
    error = t["ece"]
    return f"{'-' if error is None else f'{100 * error:.1f} %'} ({t['n']} causes)"


def markdown(t: dict) -> list[str]:
    lines = ["| told between | causes | mean told | right | 95 % interval |", "|---|---|---|---|---|"]
    lines += [f"| {b['from']:g} and {b['to']:g} | {b['n']} | {100 * b['told']:.1f} % | {100 * b['right']:.1f} % | "
              f"{100 * b['wilson'][0]:.0f} to {100 * b['wilson'][1]:.0f} % |" for b in t["bins"]]
    return lines


def svg(t: dict) -> str:
    """The diagram: share right against probability told, with intervals, numbers of causes and the diagonal."""
    side, edge = 420, 60
    x = lambda p: edge + side * p
    y = lambda p: edge / 2 + side * (1 - p)
    size = f'width="{side + 1.6 * edge:.0f}" height="{side + 1.4 * edge:.0f}"'
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="12">',
           '<rect width="100%" height="100%" fill="white"/>']
    for k in range(11):
        p = k / 10
        out.append(f'<path d="M{x(p):.1f} {y(0):.1f}V{y(1):.1f}M{x(0):.1f} {y(p):.1f}H{x(1):.1f}" stroke="#e4e4e4"/>')
        out.append(f'<text x="{x(p):.1f}" y="{y(0) + 18:.1f}" text-anchor="middle">{p:g}</text>')
        out.append(f'<text x="{x(0) - 8:.1f}" y="{y(p) + 4:.1f}" text-anchor="end">{p:g}</text>')
    out.append(f'<path d="M{x(0):.1f} {y(0):.1f}L{x(1):.1f} {y(1):.1f}" stroke="#888" stroke-dasharray="5 4"/>')
    points = [(x(b["told"]), y(b["right"])) for b in t["bins"]]
    if points:
        out.append('<polyline fill="none" stroke="#1f5fa8" stroke-width="1.5" points="' + " ".join(f"{a:.1f},{b:.1f}" for a, b in points) + '"/>')
    for b, (px, py) in zip(t["bins"], points):
        out.append(f'<path d="M{px:.1f} {y(b["wilson"][0]):.1f}V{y(b["wilson"][1]):.1f}" stroke="#1f5fa8"/>')
        title = f'{b["n"]} causes told at {b["told"]:.3f}, {b["right"]:.3f} right'
        out.append(f'<circle cx="{px:.1f}" cy="{py:.1f}" r="4" fill="#1f5fa8"><title>{title}</title></circle>')
        out.append(f'<text x="{px - 7:.1f}" y="{py + 16:.1f}" text-anchor="end" fill="#444">{b["n"]}</text>')
    told = "no cause named" if t["ece"] is None else f'calibration error {100 * t["ece"]:.1f} %, {t["n"]} causes'
    out.append(f'<text x="{x(0.02):.1f}" y="{y(0.95):.1f}" font-size="14">{told}</text>')
    out.append(f'<text x="{x(0.5):.1f}" y="{y(0) + 40:.1f}" text-anchor="middle">probability told</text>')
    out.append(f'<text transform="translate(16 {y(0.5):.1f}) rotate(-90)" text-anchor="middle">share of causes that are right</text></svg>')
    return "\n".join(out) + "\n"
