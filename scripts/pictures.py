"""Cuts the README's pictures out of reports, so that they show what the program draws. See README, "Pictures".

    python3 scripts/pictures.py diagnosis.html circle.html diagnoses/index.html
"""

import re
import sys
from pathlib import Path

# Report, start of the drawing's label, picture.
PICTURES = [
    (1, "The chain from command to trace", "diagnosis-chain.svg"),
    (1, "Plot: Against omega1.", "diagnosis-residual.svg"),
    (2, "Polar plot: Diagnosed model", "circle.svg"),
    (3, "Plot: K of press X.", "fleet-drift.svg"),
]

for report, label, name in PICTURES:
    if sys.argv[report] == "-":  # this report's pictures stay as they are
        continue
    page = Path(sys.argv[report]).read_text()
    style = re.search(r"<style>(.*?)</style>", page, re.S).group(1)
    # A picture has a white ground, whatever the reader's colours are.
    style = style.replace("color-scheme:light dark", "color-scheme:light")
    style = re.sub(r"@media screen and \(prefers-color-scheme:dark\)\{:root\{.*?\}\}", "", style, flags=re.S)
    start = re.search(r'<svg(?: class="[^"]*")? xmlns[^>]*aria-label="' + re.escape(label), page).start()
    depth = 0  # drawings stand in drawings
    for tag in re.finditer(r"<svg|</svg>", page[start:]):
        depth += 1 if tag.group() == "<svg" else -1
        if depth == 0:
            drawing = page[start : start + tag.end()]
            break
    font = "svg{font:16px system-ui,'Segoe UI',Roboto,'Liberation Sans',Arial,sans-serif}"
    ground = f"<style>{style}{font}</style><rect width='100%' height='100%' fill='#fff'/>"
    # What the page's script reads is of no use in a picture.
    drawing = re.sub(r' data-[a-z]+="[^"]*"', "", drawing)
    head, rest = drawing.split(">", 1)
    width, height = re.search(r'viewBox="0 0 (\d+) (\d+)"', head).groups()
    path = Path(__file__).resolve().parent.parent / "docs" / name
    path.write_text(f'{head} width="{width}" height="{height}">{ground}{rest}\n'.replace("&nbsp;", "&#160;"))
    print(path.name, path.stat().st_size)
