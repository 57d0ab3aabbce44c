"use strict";
// Okabe and Ito's colours, which stay apart for every kind of colour vision, each with its own dashes and mark
const COLOURS = ["#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C8C8C"];
const DASHES = ["solid", "dash", "dot", "dashdot", "longdash", "longdashdot", "solid", "dash"];
const MARKS = ["star", "square", "diamond", "cross", "triangle-up", "x", "hexagon", "circle"];
const PALE = "#D0D0D0", GREY = "#777777", MOST = COLOURS.length, FRONT = "front";
const FONT = { family: '"Liberation Sans", Arial, sans-serif', size: 12, color: "#000" };
const CONFIG = { displaylogo: false, responsive: true, modeBarButtonsToRemove: ["lasso2d", "select2d"] };

const data = JSON.parse(document.getElementById("data").textContent);
const columns = data.columns, count = data.variants.length;
const shown = columns.filter((column) => column.main), results = shown.filter((column) => column.kind === "result");
const pick = (id) => document.getElementById(id);
let chosen = data.chosen.slice(), kept = [...Array(count).keys()];

const sign = (column) => (column.better === "larger" ? -1 : 1);
const number = (value) => Number(value.toPrecision(4)).toString();
const name = (row) => "variant " + data.variants[row];

// rows that no other kept row beats in two columns, in the order of the first
function paretoFront(rows, first, second) {
  const cost = (row, column) => sign(column) * column.values[row];
  const order = rows.slice().sort((a, b) => cost(a, first) - cost(b, first) || cost(a, second) - cost(b, second) || a - b);
  let least = Infinity, last = null;
  return order.filter((row) => {
    const same = last !== null && cost(row, first) === cost(last, first) && cost(row, second) === cost(last, second);
    const best = same || cost(row, second) < least;
    if (best) { least = cost(row, second); last = row; }
    return best;
  });
}

// share of all variants that are worse or equal: 1 for the best
function shares(column) {
  const costs = column.values.map((value) => sign(column) * value), order = costs.slice().sort((a, b) => a - b);
  return (row) => {
    let low = 0, high = count;
    while (low < high) { const middle = (low + high) >> 1; if (order[middle] < costs[row]) low = middle + 1; else high = middle; }
    return (count - low) / count;
  };
}
results.forEach((column) => { column.share = shares(column); });

function fill(select, options, value) {
  for (const [key, text] of options) select.add(new Option(text, key, false, String(key) === String(value)));
}
const numbered = columns.map((column, place) => [place, column.label]);
const resultPlaces = columns.map((column, place) => place).filter((place) => columns[place].kind === "result");
fill(pick("colour"), [[FRONT, "on the Pareto front"], ...numbered], resultPlaces[0]);
fill(pick("across"), numbered, resultPlaces[0]);
fill(pick("up"), numbered, resultPlaces[1] ?? 0);
const axes = () => [columns[pick("across").value], columns[pick("up").value]];

function colouring() {
  const by = pick("colour").value;
  if (by !== FRONT) {
    const column = columns[by];
    return { color: column.values, colorscale: "Cividis", reversescale: column.better === "larger", showscale: true,
             colorbar: { title: { text: column.label, side: "right" }, tickformat: ".4~g" } };
  }
  const front = new Set(paretoFront(kept, ...axes()));
  return { color: columns[0].values.map((_, row) => (front.has(row) ? 1 : 0)), cmin: 0, cmax: 1, showscale: false,
           colorscale: [[0, PALE], [1, COLOURS[1]]] };
}

function drawParallel() {
  const dimensions = shown.map((column, place) => (
    { name: String(place), label: column.label, values: column.values, tickformat: ".4~g" }));
  const trace = { type: "parcoords", dimensions, line: colouring(), unselected: { line: { color: "#EEEEEE", opacity: 0.4 } }, labelangle: -15, labelside: "top",
                  labelfont: FONT, tickfont: FONT, rangefont: { size: 1, color: "#fff" } };
  const layout = { font: FONT, margin: { l: 70, r: 60, t: 110, b: 25 } };
  return Plotly.newPlot("parallel", [trace], layout, { ...CONFIG, displayModeBar: false });
}

// rows within every range that is drawn on an axis
function brushed() {
  // an axis that is moved changes its place among the dimensions, not its name
  const drawn = pick("parallel").data[0].dimensions.filter((each) => each.constraintrange);
  const within = (value, range) => !range || (Array.isArray(range[0]) ? range : [range])
    .some(([low, high]) => low <= value && value <= high);
  const places = drawn.map((each) => [each.constraintrange, shown[Number(each.name)]]);
  return [...Array(count).keys()].filter((row) => places.every(([range, column]) => within(column.values[row], range)));
}

function points(rows, [x, y], more) {
  return { x: rows.map((row) => x.values[row]), y: rows.map((row) => y.values[row]), customdata: rows,
           text: rows.map(name), hovertemplate: "%{text}<br>%{x:.4~g}, %{y:.4~g}<extra></extra>", ...more };
}

function drawPareto() {
  const both = axes(), front = paretoFront(kept, ...both), inside = new Set(kept);
  const out = [...Array(count).keys()].filter((row) => !inside.has(row));
  // all by one kind of drawing: another kind would lie beneath these dots, whatever the order
  const dots = (size, color) => ({ mode: "markers", type: "scattergl", marker: { size, color } });
  const traces = [
    points(out, both, { ...dots(4, PALE), name: "out of range" }),
    points(kept, both, { ...dots(5, GREY), name: `${kept.length} variants` }),
    points(front, both, { mode: "lines+markers", type: "scattergl", name: `Pareto front, ${front.length}`,
                          line: { shape: "hv", width: 1.5, color: "#000" },
                          marker: { size: 7, color: "#000" } }),
    ...chosen.map((row, place) => points([row], both, { mode: "markers", type: "scattergl", name: name(row),
      marker: { size: 15, symbol: MARKS[place], color: COLOURS[place], line: { color: "#fff", width: 1 } } })),
  ];
  const axis = (column) => ({ title: { text: `${column.label}${column.better ? `, ${column.better} is better` : ""}` },
                              tickformat: ".4~g", gridcolor: "#E5E5E5", zeroline: false, automargin: true });
  const layout = { font: FONT, margin: { l: 60, r: 15, t: 10, b: 50 }, xaxis: axis(both[0]), yaxis: axis(both[1]),
                   legend: { orientation: "h", y: -0.2 }, hovermode: "closest", plot_bgcolor: "#fff" };
  return Plotly.react("pareto", traces, layout, CONFIG);
}

function drawRadar() {
  const labels = results.map((column) => column.label.replace(/ \[/, "<br>["));
  const round = (list) => [...list, list[0]];
  const traces = chosen.map((row, place) => ({
    type: "scatterpolar", name: name(row), mode: "lines+markers", theta: round(labels),
    r: round(results.map((column) => column.share(row))),
    text: round(results.map((column) => `${name(row)}<br>${column.label}: ${number(column.values[row])}`)),
    hovertemplate: "%{text}<extra></extra>",
    line: { color: COLOURS[place], dash: DASHES[place], width: 2 }, marker: { symbol: MARKS[place], size: 8 },
  }));
  const few = results.length < 3 ? "A radar chart needs three results; the values stand below." : "";
  const note = few || (chosen.length ? "" : "No variant is chosen.");
  const layout = { font: FONT, margin: { l: 90, r: 90, t: 45, b: 45 }, legend: { orientation: "h", y: -0.12 }, showlegend: !note,
    polar: { radialaxis: { range: [0, 1], tickvals: [0, 0.5, 1], ticktext: ["", "50 %", ""], angle: 90, tickangle: 0 },
             angularaxis: { direction: "clockwise", rotation: 90 }, gridshape: "linear" },
    annotations: note ? [{ text: note, showarrow: false, x: 0.5, y: 0.5, xref: "paper", yref: "paper" }] : [] };
  if (note) { delete layout.polar; layout.xaxis = { visible: false }; layout.yaxis = { visible: false }; }
  return Plotly.react("radar", note ? [] : traces, layout, CONFIG);
}

function listChosen() {
  const table = pick("chosen");
  table.replaceChildren();
  const add = (row, text, head) => {
    const cell = document.createElement(head ? "th" : "td");
    cell.textContent = text;
    if (head) cell.scope = head;
    row.append(cell);
    return cell;
  };
  const head = table.createTHead().insertRow();
  add(head, "", "col");
  chosen.forEach((row, place) => { add(head, name(row), "col").style.borderBottom = `3px solid ${COLOURS[place]}`; });
  const body = table.createTBody();
  for (const column of columns) {
    const line = body.insertRow();
    add(line, column.label, "row");
    chosen.forEach((row) => add(line, number(column.values[row])));
  }
}

function draw() {
  drawPareto();
  drawRadar();
  listChosen();
  const [first, second] = axes(), front = paretoFront(kept, first, second);
  pick("status").textContent = `${kept.length} within the ranges, ${front.length} of them on the front, ${chosen.length} chosen.`;
}

function choose(rows) {
  const step = Math.max(1, (rows.length - 1) / (MOST - 1));  // of more, evenly along the front
  chosen = rows.length <= MOST ? rows.slice() : [...Array(MOST).keys()].map((place) => rows[Math.round(place * step)]);
  draw();
}

function recolour() {
  Plotly.restyle("parallel", { line: [colouring()] });
}

drawParallel().then(draw).then(() => {
  pick("parallel").on("plotly_restyle", (change) => {
    if (!Object.keys(change[0]).some((key) => key.includes("constraintrange"))) return;
    kept = brushed();
    draw();
    if (pick("colour").value === FRONT) recolour();
  });
  pick("pareto").on("plotly_click", (event) => {
    const row = event.points[0].customdata;
    if (chosen.includes(row)) choose(chosen.filter((each) => each !== row));
    else choose([...chosen, row].slice(-MOST));
  });
  pick("colour").addEventListener("change", recolour);
  for (const id of ["across", "up"]) pick(id).addEventListener("change", () => { draw(); if (pick("colour").value === FRONT) recolour(); });
  pick("take").addEventListener("click", () => choose(paretoFront(kept, ...axes())));
  pick("clear").addEventListener("click", () => choose([]));
});
