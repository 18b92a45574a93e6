"use strict";
(() => {
  const $ = (id) => document.getElementById(id);
  const MEANING = {
    "": "not used", time: "time", T: "T: torque, force or current", theta1: "theta1: position, motor", omega1: "omega1: speed, motor",
    alpha1: "alpha1: acceleration, motor", theta2: "theta2: position, table", omega2: "omega2: speed, table",
    alpha2: "alpha2: acceleration, table", x2: "x2: position of the table, m", reference: "reference of the drive", command: "command of the drive",
  };
  const FILES = {
    "report.html": "The report: where, what, how far", "circle.html": "The circle: what it does to a part",
    "inspection.html": "The record, drawn, with what was found", "axis.toml": "The axis file: parameters and columns",
    "improved.fmu": "The improved model as an FMU", "diagnosis.json": "The diagnosis for programs",
  };
  const PAGES = ["report.html", "circle.html", "inspection.html", "axis.toml"];
  let log = null;
  let most = Infinity;
  let watching = 0;

  const show = (id, on = true) => { $(id).hidden = !on; };
  const say = (text) => { $("live").textContent = text; };
  const problem = (id, text) => { $(id).textContent = text || ""; show(id, Boolean(text)); };
  const make = (tag, words, attributes = {}) => {
    const e = document.createElement(tag);
    if (words) e.textContent = words;
    for (const [k, v] of Object.entries(attributes)) e.setAttribute(k, v);
    return e;
  };
  const lead = (id) => {
    show(id);
    const heading = $(id).querySelector("h2");
    heading.tabIndex = -1;
    heading.focus({ preventScroll: true });
    $(id).scrollIntoView({ block: "start" });
  };

  async function ask(path, options) {
    let answer;
    try {
      answer = await fetch(path, options);
    } catch {
      throw new Error("eixo does not answer: does `eixo serve` still run?");
    }
    const told = await answer.json().catch(() => ({}));
    if (!answer.ok) throw new Error(told.error || `the answer is ${answer.status}`);
    return told;
  }
  const post = (path, body) => ask(path, { method: "POST", body: JSON.stringify(body), headers: { "Content-Type": "application/json" } });
  const own = (rest) => `logs/${log.id}/${rest}`;

  // 1
  async function bring(file) {
    if (!file) return;
    problem("bring-problem");
    watching += 1;
    for (const id of ["confirm", "findings", "work", "results"]) show(id, false);
    if (file.size > most) {
      problem("bring-problem", `${file.name} has ${(file.size / 1e6).toFixed(1)} MB; at most ${(most / 1e6).toFixed(0)} MB are taken (eixo serve --most).`);
      return;
    }
    say(`${file.name} is read`);
    try {
      log = await ask(`logs?name=${encodeURIComponent(file.name)}`, { method: "POST", body: file });
      columns();
      say(`${log.columns.length} columns, ${log.rows} rows: confirm what they are`);
      lead("confirm");
    } catch (e) {
      problem("bring-problem", `${file.name}: ${e.message}`);
    }
  }
  $("file").addEventListener("change", (e) => bring(e.target.files[0]));
  for (const kind of ["dragenter", "dragover"]) {
    document.addEventListener(kind, (e) => { e.preventDefault(); $("drop").classList.add("over"); });
  }
  document.addEventListener("dragleave", (e) => { if (!e.relatedTarget) $("drop").classList.remove("over"); });
  document.addEventListener("drop", (e) => {
    e.preventDefault();
    $("drop").classList.remove("over");
    // The field names the log that was dropped, as one that was chosen.
    if (e.dataTransfer.files.length) $("file").files = e.dataTransfer.files;
    bring(e.dataTransfer.files[0]);
  });

  // 2
  const plain = (v) => (v === 0 ? "0" : Math.abs(v) < 1e-3 || Math.abs(v) >= 1e5 ? v.toExponential(2) : String(Number(v.toPrecision(4))));
  const short = (v) => plain(v).replaceAll("-", "−");
  // The column over the rows, the value under the pointer told below; `unit` is the field beside it.
  function drawn(points, unit) {
    const NS = "http://www.w3.org/2000/svg";
    const svg = document.createElementNS(NS, "svg");
    svg.setAttribute("viewBox", "0 0 1000 84");
    svg.setAttribute("preserveAspectRatio", "none");
    const values = points.map((p) => p[1]);
    const [low, high] = [Math.min(...values), Math.max(...values)];
    const [first, last] = [points[0][0], points[points.length - 1][0]];
    svg.setAttribute("role", "img");
    svg.setAttribute("aria-label", `from ${short(low)} to ${short(high)} over the record`);
    const line = document.createElementNS(NS, "polyline");
    const x = (i) => (1000 * (i - first)) / (last - first || 1);
    const y = (v) => 80 - (76 * (v - low)) / (high - low || 1);
    line.setAttribute("points", points.map(([i, v]) => `${x(i).toFixed(1)},${y(v).toFixed(1)}`).join(" "));
    if (low < 0 && high > 0) {
      const zero = document.createElementNS(NS, "path");
      zero.setAttribute("d", `M0 ${y(0).toFixed(1)}H1000`);
      svg.append(zero);
    }
    const at = document.createElementNS(NS, "path");
    svg.append(line, at);
    const [least, reading, greatest] = [make("span"), make("span"), make("span")];
    const range = make("div", "", { class: "range" });
    range.append(least, reading, greatest);
    const value = (v) => `${short(v)} ${unit.value.trim()}`.trim();
    const told = () => { least.textContent = `least ${value(low)}`; greatest.textContent = `greatest ${value(high)}`; };
    unit.addEventListener("input", told);
    told();
    svg.addEventListener("pointermove", (e) => {
      const box = svg.getBoundingClientRect();
      const row = first + ((e.clientX - box.left) / box.width) * (last - first);
      const [i, v] = points.reduce((a, b) => (Math.abs(b[0] - row) < Math.abs(a[0] - row) ? b : a));
      reading.textContent = `row ${i + 1}: ${value(v)}`;
      at.setAttribute("d", `M${x(i).toFixed(1)} 0V84`);
    });
    svg.addEventListener("pointerleave", () => { reading.textContent = ""; at.removeAttribute("d"); });
    const box = make("div");
    box.append(svg, range);
    return box;
  }
  function columns() {
    $("log-name").textContent = log.name;
    $("rows").textContent = "";
    problem("confirm-problem");
    log.columns.forEach((c, k) => {
      const row = make("div", "", { class: "row" });
      const left = make("div");
      left.append(make("div", c.name, { class: "name", id: `name${k}` }));
      const choice = make("div", "", { class: "choice" });
      const select = make("select", "", { "aria-label": `${c.name} is`, "data-column": k });
      for (const s of ["", ...log.signals]) {
        const option = make("option", MEANING[s] || s, { value: s });
        option.selected = s === (c.role || "");
        select.append(option);
      }
      const unit = make("input", "", { "aria-label": `unit of ${c.name}`, placeholder: "SI", list: "units", spellcheck: "false", autocomplete: "off", "data-unit": k });
      unit.value = c.unit || "";
      unit.readOnly = c.unit_in_header;
      choice.append(select, unit);
      if (!c.sure) choice.append(make("span", "please check", { class: "check" }));
      left.append(choice);
      row.append(left);
      if (c.points.length) row.append(drawn(c.points, unit));
      $("rows").append(row);
      select.addEventListener("change", () => {
        // A signal has one column.
        if (select.value) for (const other of chosen()) if (other !== select && other.value === select.value) other.value = "";
        adjust();
      });
      unit.addEventListener("input", adjust);
    });
    adjust();
  }
  const chosen = () => [...document.querySelectorAll("[data-column]")];
  function picked() {
    const columns = Object.fromEntries(log.signals.map((s) => [s, ""]));
    const units = {};
    for (const select of chosen().filter((s) => s.value)) {
      const c = log.columns[select.dataset.column];
      columns[select.value] = c.name;
      const unit = document.querySelector(`[data-unit="${select.dataset.column}"]`).value.trim();
      if (unit && !c.unit_in_header) units[select.value] = unit;
    }
    return { columns, units };
  }
  const TORQUES = /^(m|k)?N(\.?(c|m)?m)?$/;
  function adjust() {
    const { columns } = picked();
    for (const s of chosen()) s.closest(".row").classList.toggle("unused", !s.value);
    show("dt-field", !columns.time);
    const torque = chosen().find((s) => s.value === "T");
    const unit = torque ? document.querySelector(`[data-unit="${torque.dataset.column}"]`).value.trim() : "";
    $("constant-of").textContent = torque ? unit || `of ${log.columns[torque.dataset.column].name}` : "";
    show("constant-field", Boolean(torque) && !TORQUES.test(unit));
  }
  $("columns").addEventListener("submit", async (e) => {
    e.preventDefault();
    problem("confirm-problem");
    const body = picked();
    if (!body.columns.T) return problem("confirm-problem", "Say which column is T: the torque, the force or the motor's current.");
    if (!body.columns.theta1 && !body.columns.theta2 && !body.columns.x2) {
      return problem("confirm-problem", "Say which column is the position of the motor (theta1) or of the table (theta2).");
    }
    if (!$("constant-field").hidden) body.torque_constant = $("constant").valueAsNumber;
    if (!$("dt-field").hidden) body.dt = $("dt").valueAsNumber;
    const button = e.target.querySelector("button");
    button.disabled = true;
    say("The record is examined");
    try {
      const told = await post(own("columns"), body);
      findings(told);
    } catch (error) {
      problem("confirm-problem", error.message);
    }
    button.disabled = false;
  });

  // 3
  function findings(told) {
    const box = $("found");
    box.textContent = "";
    const all = told.found.examination.findings || [];
    for (const f of all) {
      const text = [f.seen, f.means, f.remedy].filter(Boolean).join(" ");
      box.append(make("p", text, { class: `finding ${f.severity}` }));
    }
    for (const w of told.found.warnings || []) box.append(make("p", w, { class: "finding" }));
    const refused = all.some((f) => f.severity === "refuse");
    if (!all.length) box.prepend(make("p", "Nothing speaks against the record.", { class: "finding good" }));
    if (refused) box.prepend(make("p", "As it is, the record is not to be believed: mend what stands below, or the diagnosis gives no verdict."));
    $("drawn").href = own("files/inspection.html");
    $("axis-open").href = own("files/axis.toml");
    show("work", false);
    show("results", false);
    say(refused ? "The record is not to be believed as it is" : `Examined: ${all.length} findings`);
    lead("findings");
  }

  // 4
  // Characters of a line of what the diagnosis prints; it has no size yet while it is hidden.
  function width() {
    const brush = document.createElement("canvas").getContext("2d");
    $("said").style.removeProperty("--longest");
    const style = getComputedStyle($("said"));
    brush.font = `${style.fontSize} ${style.fontFamily}`;
    const room = $("findings").clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight);
    return Math.max(60, Math.min(100, Math.floor(room / brush.measureText("0".repeat(100)).width * 100)));
  }
  async function start(trust) {
    problem("work-problem");
    $("run").disabled = true;
    try {
      await post(own("run"), { trust, width: width() });
      show("results", false);
      lead("work");
      watch();
    } catch (e) {
      show("work");
      problem("work-problem", e.message);
      $("run").disabled = false;
    }
  }
  $("run").addEventListener("click", () => start(false));
  $("trust").addEventListener("click", () => start(true));
  $("stop").addEventListener("click", () => {
    $("stop").disabled = true;
    post(own("stop"), {}).catch((e) => problem("work-problem", e.message));
  });
  async function watch() {
    const mine = (watching += 1);
    const id = log.id;
    for (;;) {
      let told;
      try {
        told = await ask(`logs/${id}/state`);
      } catch (e) {
        if (mine === watching) { problem("work-problem", e.message); $("run").disabled = false; }
        return;
      }
      if (mine !== watching) return;
      working(told);
      if (told.state !== "running") return;
      await new Promise((r) => setTimeout(r, 500));
    }
  }
  const ENDS = {
    done: "The diagnosis is done.", refused: "No verdict: the record is not to be believed as it is.",
    failed: "The diagnosis could not run.", stopped: "The diagnosis was stopped.",
  };
  // The head of what was printed: its sentences as one text, its figures by name.
  function verdict(said) {
    const box = $("verdict");
    box.textContent = "";
    let sentences = "";
    const figures = make("dl");
    for (const line of said.split("\n\n")[0].split("\n")) {
      const pair = line.match(/^ {2}(\S.*?) {2,}(\S.*)$/);
      if (pair) {
        const figure = make("div");
        figure.append(make("dt", pair[1]), make("dd", pair[2]));
        figures.append(figure);
      }
      else sentences += ` ${line.replace(/^[!?i✓] /, "").trim()}`;
    }
    const [, first, rest] = sentences.trim().match(/^(.*?[.:])(?: (?=[A-Z])(.*))?$/) || [null, sentences.trim()];
    box.append(make("p", first, { class: "first" }));
    if (rest) box.append(make("p", rest));
    if (figures.childElementCount) box.append(figures);
  }
  function working(told) {
    const running = told.state === "running";
    const list = $("steps");
    const words = told.steps.join("\n");
    if (list.dataset.words !== words + told.state) {
      list.dataset.words = words + told.state;
      list.textContent = "";
      told.steps.forEach((s, k) => list.append(make("li", s, running && k === told.steps.length - 1 ? { "aria-current": "step" } : {})));
      say(ENDS[told.state] || told.steps[told.steps.length - 1]);
    }
    // While it runs its steps are what there is to see; then they make room.
    if ($("course").dataset.state !== told.state) $("course").open = running;
    $("course").dataset.state = told.state;
    $("clock").textContent = running ? `${told.seconds.toFixed(0)} s so far` : `${ENDS[told.state]} (${told.seconds.toFixed(1)} s)`;
    show("stop", running);
    $("stop").disabled = false;
    $("run").disabled = running;
    $("said").textContent = told.state === "failed" ? "" : told.said;
    // By it a narrow window sets the size of the letters.
    $("said").style.setProperty("--longest", Math.max(60, ...$("said").textContent.split("\n").map((line) => line.length)));
    const printed = !running && Boolean($("said").textContent);
    show("printed", printed);
    show("verdict", printed && told.state !== "stopped");
    if (printed) verdict(told.said);
    problem("work-problem", told.state === "failed" ? told.said.trim() : told.aside ? `The circle could not be drawn: ${told.aside.trim()}` : "");
    show("trust", told.state === "refused");
    if (told.state === "done") results(told.files);
  }

  // 5
  function results(files) {
    $("files").textContent = "";
    for (const name of Object.keys(FILES).filter((n) => files.includes(n))) {
      const item = make("li");
      item.append(make("span", FILES[name], { class: "what" }));
      const at = own(`files/${name}`);
      if (PAGES.includes(name)) item.append(make("a", `Open ${name}`, { href: at, target: "_blank", rel: "noopener" }));
      item.append(make("a", `Save ${name}`, { href: `${at}?save`, download: name }));
      $("files").append(item);
    }
    show("results");
  }

  ask("settings").then((s) => { most = s.most; $("folder").textContent = s.folder; }, (e) => problem("bring-problem", e.message));
})();
