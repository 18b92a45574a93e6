'use strict';
// Zoom, pan and a reading under the cursor, from what is drawn: without this script the page is whole.
(() => {
  const NS = 'http://www.w3.org/2000/svg';
  const el = (name, attributes, parent) => {
    const e = document.createElementNS(NS, name);
    for (const k in attributes) e.setAttribute(k, attributes[k]);
    if (parent) parent.append(e);
    return e;
  };
  const clamp = (v, a, b) => Math.min(Math.max(v, a), b);
  const minus = (s) => s.replace('-', '−');
  const round = (v, digits) => minus(String(Number(v.toPrecision(digits))));
  const value = (v, axis) => round(v / 10 ** axis.e, 5) + (axis.u ? ' ' + axis.u : '');
  const links = {};

  // The points of a series, in the pixels of the plot: of its lines and dots alone.
  const points = (group) => {
    const out = [];
    for (const p of group.querySelectorAll('path.line,path.dots')) {
      const d = p.getAttribute('d');
      for (const m of d.matchAll(/(-?[\d.]+) (-?[\d.]+)/g)) out.push([+m[1], +m[2]]);
    }
    let sorted = true;
    for (let i = 1; i < out.length && sorted; i++) sorted = out[i][0] >= out[i - 1][0];
    return { all: out, sorted, line: !!group.querySelector('path.line') };
  };
  // The ordinate of a series at a pixel of the abscissa; of a curve that runs back, the nearest point.
  const at = (series, x, y) => {
    const { all, sorted, line } = series;
    if (!all.length) return null;
    if (!sorted) return all.reduce((b, p) => (Math.hypot(p[0] - x, p[1] - y) < Math.hypot(b[0] - x, b[1] - y) ? p : b));
    let a = 0, b = all.length - 1;
    if (x < all[a][0] - 4 || x > all[b][0] + 4) return null;
    while (b - a > 1) { const m = (a + b) >> 1; if (all[m][0] <= x) a = m; else b = m; }
    const [p, q] = [all[a], all[b]];
    if (line && q[0] > p[0]) return [x, p[1] + ((q[1] - p[1]) * clamp(x - p[0], 0, q[0] - p[0])) / (q[0] - p[0])];
    return Math.abs(p[0] - x) <= Math.abs(q[0] - x) ? p : q;
  };

  const steps = (low, high, count) => {
    const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
    const step = power * [1, 2, 5, 10].find((s) => raw <= s * power * (1 + 1e-9));
    const out = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high * (1 + 1e-12) + 1e-9 * step && out.length < 60; i++) out.push(i * step);
    return [out, step];
  };
  const ticks = (axis, low, high, count) => {
    const wide = axis.log && high / low > 20;
    if (wide) {
      const out = [];
      for (let k = Math.floor(Math.log10(low)); k <= Math.log10(high); k++)
        for (const d of high / low > 1e3 ? [1] : [1, 2, 5]) if (d * 10 ** k >= low && d * 10 ** k <= high) out.push([d * 10 ** k, round(d * 10 ** k, 1)]);
      return out;
    }
    const f = 10 ** axis.e, [values, step] = steps(low / f, high / f, count);
    const decimals = clamp(-Math.floor(Math.log10(step) + 1e-9), 0, 12);
    return values.map((v) => [v * f, minus(v.toFixed(decimals))]);
  };

  const tip = document.createElement('div');
  tip.className = 'tip';
  tip.setAttribute('role', 'status');
  tip.hidden = true;
  document.body.append(tip);
  const show = (event, head, rows) => {
    tip.replaceChildren();
    const line = (text, from) => {
      const p = document.createElement('div');
      if (from) { const i = document.createElement('i'); i.className = from; p.append(i); }
      p.append(text);
      tip.append(p);
    };
    line(head);
    for (const [name, text, from] of rows) line((name ? name + ': ' : '') + text, from);
    tip.hidden = false;
    const box = tip.getBoundingClientRect();
    const left = event.clientX + 14 + box.width > innerWidth ? event.clientX - 14 - box.width : event.clientX + 14;
    tip.style.left = Math.max(2, left) + scrollX + 'px';
    tip.style.top = Math.max(2, event.clientY - box.height - 10) + scrollY + 'px';
  };
  const hide = () => { tip.hidden = true; };

  const button = (text, label, act) => {
    const b = document.createElement('button');
    b.type = 'button'; b.textContent = text; b.title = label; b.setAttribute('aria-label', label);
    b.addEventListener('click', act);
    return b;
  };

  class Plot {
    constructor(svg) {
      this.svg = svg;
      this.data = JSON.parse(svg.dataset.plot);
      this.polar = this.data.polar;
      this.inner = this.polar ? svg : svg.querySelector('svg');
      const b = this.inner.viewBox.baseVal;
      this.home = [b.x, b.y, b.width, b.height];
      this.view = [...this.home];
      this.groups = [...this.inner.querySelectorAll('g[data-s]')];
      if (!this.polar) this.inner.setAttribute('preserveAspectRatio', 'none');
      this.cursor = el('path', { class: 'cursor' }, this.inner);
      this.dots = el('g', {}, this.inner);
      this.listen();
      const x = this.data.x;
      if (!this.polar && x.n === 'time') { this.link = x.u0; (links[this.link] ||= []).push(this); }
    }
    // Where an event is, in the pixels of the plot as it is seen now; none outside of it.
    place(event) {
      const m = this.inner.getScreenCTM();
      if (!m) return null;
      const p = new DOMPoint(event.clientX, event.clientY).matrixTransform(m.inverse());
      const [x, y, w, h] = this.view;
      return p.x < x || p.x > x + w || p.y < y || p.y > y + h ? null : p;
    }
    value(axis, share) { return axis.log ? axis.lo * (axis.hi / axis.lo) ** share : axis.lo + (axis.hi - axis.lo) * share; }
    share(axis, v) { return axis.log ? Math.log(v / axis.lo) / Math.log(axis.hi / axis.lo) : (v - axis.lo) / (axis.hi - axis.lo); }
    xAt(px) { return this.value(this.data.x, px / this.home[2]); }
    yAt(px) { return this.value(this.data.y, 1 - px / this.home[3]); }

    set(view, told) {
      const [hx, hy, hw, hh] = this.home;
      const w = clamp(view[2], hw / 200, hw), h = clamp(view[3], hh / 200, hh);
      this.view = [clamp(view[0], hx, hx + hw - w), clamp(view[1], hy, hy + hh - h), w, h];
      this.inner.setAttribute('viewBox', this.view.join(' '));
      const zoomed = w < hw * 0.9999 || h < hh * 0.9999;
      this.svg.classList.toggle('zoomed', zoomed);
      if (!this.polar) this.axes(zoomed);
      this.cursor.setAttribute('d', '');
      this.dots.replaceChildren();
      if (this.link && !told) {
        const from = this.xAt(this.view[0]), to = this.xAt(this.view[0] + w);
        // Whole is whole for all, though one record is shorter than the other.
        for (const p of links[this.link]) if (p !== this) zoomed ? p.window(from, to) : p.set(p.home, true);
      }
    }
    // The same stretch of time as another plot shows.
    window(from, to) {
      const a = clamp(this.share(this.data.x, from), 0, 1) * this.home[2], b = clamp(this.share(this.data.x, to), 0, 1) * this.home[2];
      if (b - a > this.home[2] / 200) this.set([a, this.view[1], b - a, this.view[3]], true);
    }
    axes(zoomed) {
      this.svg.querySelectorAll(':scope>.live').forEach((e) => e.remove());
      if (!zoomed) return;
      const { l, t, x, y } = this.data, [, , w, h] = this.home, [vx, vy, vw, vh] = this.view;
      const grid = el('g', { class: 'grid live' }), text = el('g', { class: 't live' }, this.svg);
      this.svg.insertBefore(grid, this.inner);
      for (const [v, label] of ticks(x, this.xAt(vx), this.xAt(vx + vw), Math.max(2, w / 110))) {
        const at = l + ((this.share(x, v) * w - vx) / vw) * w;
        el('path', { d: `M${at} ${t}v${h}` }, grid);
        el('text', { x: at, y: t + h + 17, 'text-anchor': 'middle' }, text).textContent = label;
      }
      for (const [v, label] of ticks(y, this.yAt(vy + vh), this.yAt(vy), Math.max(2, h / 55))) {
        const at = t + (((1 - this.share(y, v)) * h - vy) / vh) * h;
        el('path', { d: `M${l} ${at}h${w}` }, grid);
        el('text', { x: l - 6, y: at + 4, 'text-anchor': 'end' }, text).textContent = label;
      }
    }
    zoom(by, px, py, onlyX) {
      const [x, y, w, h] = this.view;
      // The middle of a circle is empty: without a place a polar plot that is seen whole opens at its right side.
      const side = this.polar && !this.svg.classList.contains('zoomed') ? this.polar.cx + this.polar.base - x - w / 2 : 0;
      const cx = px ?? x + w / 2 + 1.6 * side, cy = py ?? y + h / 2, byY = onlyX ? 1 : by;
      this.set([cx - (cx - x) * by, cy - (cy - y) * byY, w * by, h * byY]);
    }
    series() {
      this.read ||= this.groups.map(points);
      return this.groups.map((g, i) => [g, this.read[i]]).filter(([g]) => !g.hasAttribute('hidden'));
    }
    name(g) { return g.querySelector('title')?.textContent ?? ''; }
    mark(found) {
      const [, , vw, vh] = this.view, [, , w, h] = this.home;
      this.dots.replaceChildren();
      for (const [g, p] of found) el('ellipse', { class: 'at ' + g.getAttribute('class'), cx: p[0], cy: p[1], rx: (4 * vw) / w, ry: (4 * vh) / h }, this.dots);
    }
    hover(event) {
      const p = this.place(event);
      if (!p) return this.leave();
      const rows = [], found = [];
      if (this.polar) {
        const { cx, cy, base, k, axis } = this.polar, angle = Math.atan2(cy - p.y, p.x - cx);
        for (const [g, s] of this.series()) {
          s.angles ||= s.all.map((q) => Math.atan2(cy - q[1], q[0] - cx));
          let best = -1, near = 0.05;
          s.angles.forEach((a, i) => { const d = Math.abs(Math.atan2(Math.sin(a - angle), Math.cos(a - angle))); if (d < near) { near = d; best = i; } });
          if (best < 0) continue;
          const q = s.all[best];
          rows.push([this.name(g), value((Math.hypot(q[0] - cx, q[1] - cy) - base) / k, axis), g.getAttribute('class')]);
          found.push([g, q]);
        }
        this.mark(found);
        return show(event, `angle: ${round(((angle * 180) / Math.PI + 360) % 360, 4)}°`, rows);
      }
      const { x, y } = this.data;
      for (const [g, s] of this.series()) {
        const q = at(s, p.x, p.y);
        if (!q) continue;
        rows.push([this.name(g), (s.sorted ? '' : `${value(this.xAt(q[0]), x)}, `) + value(this.yAt(q[1]), y), g.getAttribute('class')]);
        found.push([g, q]);
      }
      this.mark(found);
      this.hair(p.x);
      if (this.link) for (const other of links[this.link]) if (other !== this) other.hair(other.share(other.data.x, this.xAt(p.x)) * other.home[2]);
      show(event, `${x.n}: ${value(this.xAt(p.x), x)}`, rows);
    }
    hair(px) {
      this.cursor.setAttribute('d', px >= this.view[0] && px <= this.view[0] + this.view[2] ? `M${px} ${this.view[1]}v${this.view[3]}` : '');
    }
    leave() {
      hide();
      for (const p of this.link ? links[this.link] : [this]) { p.cursor.setAttribute('d', ''); p.dots.replaceChildren(); }
    }
    listen() {
      const s = this.svg;
      s.tabIndex = 0;
      let start = null, box = null;
      s.addEventListener('pointerdown', (e) => {
        const p = this.place(e);
        if (!p || e.button) return;
        start = { p, view: [...this.view], id: e.pointerId, pan: s.classList.contains('zoomed') && !e.shiftKey, x: e.clientX, y: e.clientY };
      });
      s.addEventListener('pointermove', (e) => {
        if (!start) return this.hover(e);
        const m = this.inner.getScreenCTM();
        const dx = (e.clientX - start.x) / m.a, dy = (e.clientY - start.y) / m.d;
        if (Math.abs(e.clientX - start.x) + Math.abs(e.clientY - start.y) < 5) return;
        if (!s.hasPointerCapture(start.id)) s.setPointerCapture(start.id);
        hide();
        if (start.pan) return this.set([start.view[0] - dx, start.view[1] - dy, start.view[2], start.view[3]]);
        box ||= el('rect', { class: 'select' }, this.inner);
        const tall = this.polar || Math.abs(e.clientY - start.y) > 24;
        const [, vy, , vh] = this.view;
        start.box = [Math.min(start.p.x, start.p.x + dx), tall ? Math.min(start.p.y, start.p.y + dy) : vy, Math.abs(dx), tall ? Math.abs(dy) : vh];
        if (this.polar) start.box[2] = start.box[3] = Math.max(start.box[2], start.box[3]);
        ['x', 'y', 'width', 'height'].forEach((k, i) => box.setAttribute(k, start.box[i]));
      });
      const end = () => {
        if (start?.box && start.box[2] > this.home[2] / 150 && start.box[3] > this.home[3] / 150) this.set(start.box);
        box?.remove();
        box = start = null;
      };
      s.addEventListener('pointerup', end);
      s.addEventListener('pointercancel', end);
      s.addEventListener('pointerleave', () => { if (!start) this.leave(); });
      s.addEventListener('dblclick', () => this.set(this.home));
      s.addEventListener('wheel', (e) => {
        const p = this.place(e);
        // The page scrolls over a plot that was not chosen.
        if (!p || !(e.ctrlKey || document.activeElement === s)) return;
        e.preventDefault();
        this.zoom(e.deltaY < 0 ? 0.8 : 1.25, p.x, p.y, e.shiftKey);
      }, { passive: false });
      s.addEventListener('keydown', (e) => {
        const [x, y, w, h] = this.view;
        const moves = { ArrowLeft: [-0.2, 0], ArrowRight: [0.2, 0], ArrowUp: [0, -0.2], ArrowDown: [0, 0.2] }[e.key];
        if (e.key === '+') this.zoom(0.7);
        else if (e.key === '-') this.zoom(1 / 0.7);
        else if (e.key === '0' || e.key === 'Escape') this.set(this.home);
        else if (moves && s.classList.contains('zoomed')) this.set([x + moves[0] * w, y + moves[1] * h, w, h]);
        else return;
        e.preventDefault();
      });
    }
  }

  for (const figure of document.querySelectorAll('figure')) {
    const all = [...figure.querySelectorAll('svg[data-plot]')].map((s) => new Plot(s));
    if (!all.length) continue;
    const tools = document.createElement('div');
    tools.className = 'tools';
    const each = (act) => () => all.forEach(act);
    tools.append(
      button('+', 'zoom in', each((p) => p.zoom(0.6, undefined, undefined, !p.polar))),
      button('−', 'zoom out', each((p) => p.zoom(1 / 0.6))),
      button('⟲', 'whole plot', each((p) => p.set(p.home))),
    );
    const seen = (index, on) => all.forEach((p) => p.groups.filter((g) => g.dataset.s === index).forEach((g) => g.toggleAttribute('hidden', !on)));
    const items = [...figure.querySelectorAll('.legend li[data-s]')];
    const press = (li, on) => { li.setAttribute('aria-pressed', on); seen(li.dataset.s, on); };
    if (items.length > 1)
      for (const li of items) {
        li.tabIndex = 0;
        li.setAttribute('role', 'button');
        li.setAttribute('aria-pressed', 'true');
        li.title = 'show or hide';
        const toggle = () => press(li, li.getAttribute('aria-pressed') !== 'true');
        li.addEventListener('click', toggle);
        li.addEventListener('keydown', (e) => { if (e.key === 'Enter' || e.key === ' ') { e.preventDefault(); toggle(); } });
      }
    const when = (w) => items.filter((li) => li.dataset.when === w);
    if (when('before').length && when('after').length) {
      const state = (before, after) => () => {
        when('before').forEach((li) => press(li, before));
        when('after').forEach((li) => press(li, after));
      };
      tools.append(button('before', 'the model before alone', state(true, false)), button('after', 'the model after alone', state(false, true)), button('both', 'both models', state(true, true)));
    }
    figure.append(tools);
  }
  // Paper shows the whole plots.
  addEventListener('beforeprint', hide);
})();
