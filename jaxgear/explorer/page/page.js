"use strict";
/* The page: state of the sliders, one question at a time to the server, and what its answers show. */

const REST = 250; // ms without a movement until the fine grid is asked for
const RETRY = 1000; // ms
const NARROW = { transmission_error: { x: [0, 2], least: 0.2 }, load_sharing: { zero: true }, pressure: { zero: true, least: 100 },
  orders: { zero: true, stems: true, least: 0.05 }, over_torque: { zero: true, least: 0.1 },
  pinion: { down: true, least: 4 }, wheel: { down: true, least: 4 }, plane_of_action: {} };
const ORDER = ["pinion", "wheel", "orders", "transmission_error", "over_torque", "load_sharing", "pressure", "plane_of_action"];

const $ = (id) => document.getElementById(id);
const page = {
  values: {}, start: null, socket: null, number: 0, waiting: false, changed: false, shown: null, last: null, beside: {},
  pins: [], hidden: new Set(), past: [], future: [], charts: {}, timings: [], rests: 0, reference: null, optimizing: null,
};
window.jaxgear = page; // for the console
const token = new URLSearchParams(location.search).get("token") || "";

// ---------------------------------------------------------------- the server

function connect() {
  const socket = new WebSocket(`ws://${location.host}/answers?token=${encodeURIComponent(token)}`);
  page.socket = socket;
  socket.onmessage = (event) => take(JSON.parse(event.data));
  socket.onclose = (event) => {
    page.waiting = false;
    page.optimizing = null;
    $("stop").hidden = true;
    if (event.code === 4403) return tell(event.reason, true);
    say("not connected");
    tell("The server has ended or cannot be reached; trying again.", true);
    setTimeout(connect, RETRY);
  };
}

function send(message) {
  if (page.socket.readyState === WebSocket.OPEN) page.socket.send(JSON.stringify(message));
}

function take(answer) {
  const kinds = { stage: staged, start: started, move: moved, rest: rested, robust: scattered, progress: progressed,
    optimized, written, refused };
  kinds[answer.kind](answer);
}

const say = (text) => { $("status").textContent = text; };

function tell(text, bad = false, link = "") {
  const box = $("message");
  box.hidden = !text;
  box.className = bad ? "bad" : "";
  box.textContent = text;
  if (link) {
    const anchor = box.appendChild(document.createElement("a"));
    Object.assign(anchor, { href: link, target: "_blank", textContent: " open the report", rel: "noopener" });
  }
}

function staged(answer) { say(answer.text); tell(answer.failed ? answer.text : "", answer.failed); }

function refused(answer) {
  if (answer.of === "move" || answer.of === "rest") page.waiting = false;
  if (answer.of === "optimize") searched();
  if (answer.of === "report") $("report").disabled = false;
  tell(`${answer.of}: ${answer.text}`, true);
}

// ---------------------------------------------------------------- movements

/** A slider has moved: ask for the newest state, one question at a time. */
function move(began = performance.now()) {
  page.began ??= began;
  document.body.classList.add("moving");
  clearTimeout(page.resting);
  page.resting = setTimeout(rest, REST);
  page.changed = true;
  ask();
}

function ask() {
  if (page.waiting || !page.changed) return;
  page.waiting = true;
  page.changed = false;
  page.asked = { number: ++page.number, values: { ...page.values }, began: page.began };
  page.began = undefined;
  send({ kind: "move", number: page.number, values: page.values });
}

function rest() {
  if (page.waiting || page.changed) { page.resting = setTimeout(rest, 50); return; }
  document.body.classList.remove("moving");
  send({ kind: "rest", number: ++page.number, values: page.values });
  history.replaceState(null, "", `#${new URLSearchParams(page.values)}`);
}

function moved(answer) {
  if (answer.number !== page.asked?.number) return;
  page.waiting = false;
  page.last = answer;
  page.robust = null;
  show(answer, "moving", page.asked.values);
  gains(answer.gradient);
  const { began } = page.asked;
  requestAnimationFrame(() => setTimeout(() => {
    if (began !== undefined) page.timings.push(performance.now() - began);
    if (page.timings.length > 20000) page.timings.splice(0, 10000);
  }, 0));
  ask();
}

function rested(answer) {
  if (answer.number !== page.number) return; // something has moved since
  page.rests += 1;
  page.beside = answer.beside;
  show(answer, "rest", page.values);
  findings(answer.findings);
  if (page.arrived) {
    page.arrived = false;
    pin(`optimum ${page.optima = (page.optima ?? 0) + 1}`, page.reference);
  } else compare();
}

/** Show numbers and curves of an answer. */
function show(answer, grid, values) {
  page.shown = { charts: answer.charts, numbers: answer.numbers, handles: answer.handles, grid, values };
  const { charts } = page;
  for (const [name, chart] of Object.entries(charts)) {
    if (name === "over_torque") chart.draw({ x: page.start.torques, y: page.last.over_torque });
    else if (name === "plane_of_action") { chart.map = answer.charts[name]; chart.draw(answer.charts[name]); }
    else {
      if (name === "transmission_error") chart.quantiles = page.robust;
      chart.draw(answer.charts[name], name === "pressure" ? answer.charts.corners : null);
    }
  }
  handles();
  numbers();
  say(`${grid === "rest" ? "" : "coarse while it moves, "}${page.start.grids[grid]}`);
  document.body.dataset.grid = grid;
  if (answer.failed) tell(`Not converged: ${answer.failed}; do not use these numbers.`, true);
  else if (!page.keep) tell("");
}

function handles() {
  for (const gear of ["pinion", "wheel"]) {
    const relief = page.shown.handles[gear], profile = page.shown.charts[gear], chart = page.charts[gear];
    const wanted = [];
    const at = (x) => {
      const { x: xs, y: ys } = profile, n = xs.length - 1;
      const i = Math.min(Math.max(Math.floor((x - xs[0]) / (xs[n] - xs[0]) * n), 0), n - 1);
      return ys[i] + (x - xs[i]) / (xs[i + 1] - xs[i]) * (ys[i + 1] - ys[i]);
    };
    const held = { began: () => {}, ended: remember };
    if (relief?.amount) {
      wanted.push({ ...held, id: "tip", label: `tip relief of the ${gear}, amount`, x: relief.tip, y: at(relief.tip),
        drag: (_, dy) => set(relief.amount, page.values[relief.amount] + dy) });
    }
    if (relief?.length) {
      wanted.push({ ...held, id: "start", label: `tip relief of the ${gear}, start`, x: relief.start, y: at(relief.start),
        drag: (dx) => set(relief.length, page.values[relief.length] + dx / relief.per_length) });
    }
    chart.setHandles(wanted);
  }
}

// ---------------------------------------------------------------- numbers

function format(value, form) {
  if (value === null) return "-";
  const digits = Number(form.slice(1, -1) || 4);
  if (form.endsWith("f")) return value.toFixed(digits);
  return Number(value.toPrecision(digits)).toString();
}

function numbers() {
  const reference = page.pins.find((pin) => pin === page.reference);
  page.start.quantities.forEach((quantity, i) => {
    const cell = $("numbers").children[i], value = page.shown.numbers[i];
    cell.dataset.value = value;
    cell.querySelector(".value").textContent = format(value, quantity.form);
    const delta = cell.querySelector(".delta");
    const other = reference?.numbers[i];
    delta.textContent = "";
    if (reference && value !== null && other !== null) {
      const by = value - other;
      delta.textContent = `${by < 0 ? "\u2212" : "+"}${format(Math.abs(by), quantity.form)}`;
      delta.className = `delta ${Number(format(Math.abs(by), quantity.form)) === 0 ? "" : (by < 0) === (quantity.better === "smaller") ? "better" : "worse"}`;
      delta.title = `against ${reference.name}`;
    }
  });
}

function findings(lines) {
  $("findings").replaceChildren(...lines.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
}

/** Bars beside the sliders: what a full range would gain by the gradient of the objective. */
function gains(gradient) {
  const index = page.start.quantities.findIndex((quantity) => quantity.name === $("objective").value);
  const quantity = page.start.quantities[index], sign = quantity.better === "smaller" ? 1 : -1;
  const by = page.start.sliders.map((slider, i) => gradient[index][i] === null ? 0 : gradient[index][i] * (slider.high - slider.low));
  const most = Math.max(...by.map(Math.abs)) || 1;
  page.start.sliders.forEach((slider, i) => {
    const box = document.querySelector(`[data-slider="${slider.name}"]`), half = 50 * Math.abs(by[i]) / most;
    const left = sign * by[i] > 0; // downhill towards smaller values
    const bar = box.querySelector("rect");
    bar.setAttribute("x", left ? 50 - half : 50);
    bar.setAttribute("width", half);
    const gain = Math.abs(by[i]);
    box.querySelector(".by").textContent = gain ? `${left ? "\u25C0" : "\u25B6"} ${Number(gain.toPrecision(2))} ${quantity.unit.replace("um", "\u00B5m")}` : "";
    box.dataset.gain = by[i];
  });
}

// ---------------------------------------------------------------- other designs

function compare() {
  if (!page.shown) return;
  const grey = page.start.styles.unmodified, [rule] = page.start.styles.others;
  const designs = [
    { name: "unmodified", color: grey, dash: "solid", charts: page.beside.unmodified },
    { name: "rule-based", color: rule, dash: "dash", charts: page.beside["rule-based"] },
    ...page.pins,
  ].filter((design) => design.charts && !page.hidden.has(design.name));
  for (const [name, chart] of Object.entries(page.charts)) {
    if (name === "plane_of_action") { chart.compare([]); continue; }
    chart.compare(designs.filter((design) => design.charts[name]).map((design) => ({
      ...design.charts[name], name: design.name, color: design.color, dash: design.dash })));
  }
}

function lines() {
  const box = $("curves"), [legend] = box.children;
  const fixed = [["unmodified", page.start.styles.unmodified], ["rule-based", page.start.styles.others[0]]];
  const rows = [...fixed.map(([name, color]) => ({ name, color })), ...page.pins].map((design) => {
    const row = document.createElement("div"), label = row.appendChild(document.createElement("label"));
    const tick = label.appendChild(Object.assign(document.createElement("input"), { type: "checkbox", checked: !page.hidden.has(design.name) }));
    tick.onchange = () => { page.hidden[tick.checked ? "delete" : "add"](design.name); compare(); };
    const swatch = label.appendChild(Object.assign(document.createElement("span"), { className: "swatch" }));
    swatch.style.borderColor = design.color;
    label.append(design.name);
    if (design.values) {
      const button = (text, title, act) => {
        const made = row.appendChild(Object.assign(document.createElement("button"), { type: "button", textContent: text, title }));
        made.setAttribute("aria-label", `${title}: ${design.name}`);
        made.onclick = act;
      };
      button("\u0394", "difference to this design", () => { page.reference = page.reference === design ? null : design; numbers(); });
      button("\u21E4", "go there", () => go(design.values));
      button("\u00D7", "remove", () => {
        page.pins.splice(page.pins.indexOf(design), 1);
        if (page.reference === design) page.reference = page.pins.at(-1) ?? null;
        lines(); compare(); numbers();
      });
    }
    return row;
  });
  box.replaceChildren(legend, ...rows);
}

function pin(name, reference) {
  const { styles } = page.start, number = (page.pinned = (page.pinned ?? 0) + 1);
  const design = {
    name: name ?? `pinned ${number}`, color: styles.others[1 + (number - 1) % (styles.others.length - 1)], dash: ["dot", "dashdot", "longdash"][number % 3],
    values: { ...page.shown.values }, numbers: page.shown.numbers,
    charts: { ...page.shown.charts, over_torque: { x: page.start.torques, y: page.last.over_torque } },
  };
  page.pins.push(design);
  page.reference = reference ?? design;
  lines(); compare(); numbers();
}

// ---------------------------------------------------------------- state

function set(name, value, began) {
  const slider = page.start.sliders.find((each) => each.name === name);
  if (!Number.isFinite(value)) return;
  page.values[name] = Math.min(Math.max(value, slider.low), slider.high);
  field(name);
  move(began);
}

function field(name) {
  const box = document.querySelector(`[data-slider="${name}"]`), value = page.values[name];
  box.querySelector("[type=range]").value = value;
  const number = box.querySelector("[type=number]");
  if (document.activeElement !== number) number.value = Number(value.toPrecision(5));
}

function go(values) {
  page.values = { ...page.values, ...values };
  Object.keys(values).forEach(field);
  move();
  remember();
}

/** Keep the state for undo, after a slider was let go. */
function remember() {
  const now = JSON.stringify(page.values);
  if (page.past.at(-1) === now) return;
  page.past.push(now);
  page.future = [];
  buttons();
}

function step(from, to) {
  if (from === page.past && from.length < 2) return;
  if (from === page.future && !from.length) return;
  to.push(from.pop());
  page.values = JSON.parse(page.past.at(-1));
  Object.keys(page.values).forEach(field);
  buttons();
  move();
}
const undo = () => step(page.past, page.future);
const redo = () => step(page.future, page.past);

function buttons() {
  $("undo").disabled = page.past.length < 2;
  $("redo").disabled = !page.future.length;
}

// ---------------------------------------------------------------- work on the server

function optimize() {
  page.optimizing = true;
  $("optimize").disabled = true;
  $("stop").hidden = false;
  page.keep = true;
  tell("searching: compiling");
  send({ kind: "optimize", values: page.values, objective: $("objective").value });
}

function progressed({ step, steps, best }) { tell(`searching: ${step} of ${steps}, best ${best === null ? "-" : best.toPrecision(4)}`); }

function searched() {
  page.optimizing = null;
  page.keep = false;
  $("optimize").disabled = false;
  $("stop").hidden = true;
}

function optimized({ values }) {
  searched();
  if (values === null) return tell("search stopped");
  tell("");
  go(values);
  page.arrived = true; // to be pinned with its answer on the fine grid
}

function scattered(answer) {
  if (answer.number !== page.number) return;
  page.robust = answer;
  page.charts.transmission_error.quantiles = answer;
  page.charts.transmission_error.compare(page.charts.transmission_error.others);
  const { ppte } = answer, failed = ppte.failed ? `, ${ppte.failed} not converged` : "";
  tell(`${ppte.samples} manufactured pairs${failed}: PPTE ${ppte.mean.toFixed(3)} um on average, 95 % below ${ppte.quantile95.toFixed(3)} um, ${ppte.nominal.toFixed(3)} um without deviations.`);
}

function written({ files, folder, link }) { $("report").disabled = false; tell(`written: ${files.join(", ")} in ${folder}`, false, link); }

const file = () => $("name").value.trim().replace(/\.toml$/, "");

// ---------------------------------------------------------------- the first answer

function started(answer) {
  const again = page.start !== null;
  page.start = answer;
  tell("");
  if (!again) build(answer);
  page.changed = false;
  page.waiting = false;
  move();
}

function build(answer) {
  document.title = `${answer.title} - jaxgear`;
  $("title").textContent = answer.title;
  $("name").value = `${answer.file.replace(/\.toml$/, "")}_explored`;
  $("robust").hidden = !answer.manufactured;
  for (const quantity of answer.quantities) {
    $("objective").append(new Option(quantity.words, quantity.name));
    const box = document.createElement("div");
    box.dataset.quantity = quantity.name;
    const unit = quantity.unit ? ` [${quantity.unit.replace("um", "\u00B5m")}]` : "";
    box.append(Object.assign(document.createElement("dt"), { textContent: quantity.words + unit }));
    const value = box.appendChild(document.createElement("dd"));
    value.append(Object.assign(document.createElement("span"), { className: "value" }), Object.assign(document.createElement("span"), { className: "delta" }));
    $("numbers").append(box);
  }
  for (const group of new Set(answer.sliders.map((slider) => slider.group))) {
    $("sliders").append(Object.assign(document.createElement("h2"), { textContent: group }));
    for (const slider of answer.sliders.filter((each) => each.group === group)) {
      $("sliders").append(sliderOf(slider));
      page.values[slider.name] = slider.value;
    }
  }
  const given = new URLSearchParams(location.hash.slice(1));
  for (const slider of answer.sliders) {
    const value = Number(given.get(slider.name) ?? NaN);
    if (given.has(slider.name) && Number.isFinite(value)) page.values[slider.name] = Math.min(Math.max(value, slider.low), slider.high);
    field(slider.name);
  }
  for (const name of ORDER.filter((each) => answer.charts[each])) {
    const wide = name === "transmission_error" || (name === "pressure" && !answer.charts.plane_of_action);
    page.charts[name] = new Chart($("charts"), name, answer.charts[name], { ...NARROW[name], wide, ink: answer.styles.now });
  }
  page.past = [JSON.stringify(page.values)];
  lines();
}

function sliderOf(slider) {
  const box = document.createElement("div"), span = slider.high - slider.low;
  box.className = "slider";
  box.dataset.slider = slider.name;
  const id = `slider-${slider.name}`;
  const label = box.appendChild(Object.assign(document.createElement("label"), { textContent: slider.label }));
  label.htmlFor = id;
  const range = box.appendChild(Object.assign(document.createElement("input"), { type: "range", id, min: slider.low, max: slider.high, step: span / 1000 }));
  const number = box.appendChild(Object.assign(document.createElement("input"), { type: "number", min: slider.low, max: slider.high, step: "any" }));
  number.setAttribute("aria-label", `${slider.label}${slider.unit ? ` in ${slider.unit}` : ""}, ${slider.low} to ${slider.high}`);
  box.append(Object.assign(document.createElement("span"), { className: "unit", textContent: slider.unit.replace("um", "\u00B5m") }));
  const gain = box.appendChild(document.createElement("div"));
  gain.className = "gain";
  gain.innerHTML = '<svg viewBox="0 0 100 8" preserveAspectRatio="none" aria-hidden="true"><rect y="1" height="6" x="50" width="0" fill="#0072b2"/><path d="M50 0V8" stroke="#000" vector-effect="non-scaling-stroke"/></svg><span class="by"></span>';
  range.addEventListener("input", (event) => set(slider.name, Number(range.value), event.timeStamp));
  range.addEventListener("change", remember);
  number.addEventListener("input", () => { if (number.value !== "") set(slider.name, Number(number.value)); });
  number.addEventListener("change", () => { field(slider.name); remember(); });
  number.addEventListener("blur", () => field(slider.name));
  return box;
}

$("undo").onclick = undo;
$("redo").onclick = redo;
$("pin").onclick = () => page.shown && pin();
$("optimize").onclick = optimize;
$("stop").onclick = () => { send({ kind: "stop" }); tell("stopping at the next step"); };
$("robust").onclick = () => send({ kind: "robust", number: page.number, values: page.values });
$("save").onclick = () => send({ kind: "save", name: file(), values: page.values });
$("report").onclick = () => { $("report").disabled = true; tell("writing the report"); send({ kind: "report", name: file(), values: page.values }); };
$("link").onclick = async () => {
  const link = `${location.origin}/?token=${encodeURIComponent(token)}#${new URLSearchParams(page.values)}`;
  try { await navigator.clipboard.writeText(link); tell("link copied"); } catch { tell(link); }
};
$("objective").onchange = () => page.last && gains(page.last.gradient);
$("design").onsubmit = (event) => event.preventDefault();
document.addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || event.target.matches("#name, [type=number]")) return;
  const key = event.key.toLowerCase();
  if (key === "z" || key === "y") {
    event.preventDefault();
    (key === "y" || event.shiftKey ? redo : undo)();
  }
});
connect();
