"use strict";
/* Charts: Plotly draws axes, grid and the lines of other designs; what moves is one path over them, since Plotly takes
   15 ms and more for every chart. */

const AIR = 0.06; // about the data

/** Scale of a linear axis: from data to pixels, and back. */
function scale([low, high], from, to) {
  const slope = (to - from) / (high - low || 1);
  return { at: (value) => from + (value - low) * slope, per: 1 / slope };
}

/** Limits of all finite numbers of several lists; null where there are none. */
function limits(lists) {
  let low = Infinity, high = -Infinity;
  for (const list of lists) for (const value of list) {
    if (value === null) continue;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return low <= high ? [low, high] : null;
}

class Chart {
  /**
   * @param {HTMLElement} parent
   * @param {string} name
   * @param {{x: string, y: string, letters: [string, number][]}} frame labels
   * @param {{x?: number[], zero?: boolean, down?: boolean, stems?: boolean, wide?: boolean, ink: string, least?: number}} options
   */
  constructor(parent, name, frame, options) {
    this.options = options;
    this.box = document.createElement("div");
    this.box.className = options.wide ? "chart wide" : "chart";
    this.box.dataset.chart = name;
    this.canvas = this.box.appendChild(document.createElement("canvas"));
    this.plot = this.box.appendChild(document.createElement("div"));
    this.plot.className = "plot";
    const make = (kind, attributes) => {
      const node = document.createElementNS("http://www.w3.org/2000/svg", kind);
      for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
      return node;
    };
    this.over = this.box.appendChild(make("svg", { class: "over", role: "img", "aria-label": `${frame.y} over ${frame.x}`.replaceAll("\n", " ") }));
    const clip = this.over.appendChild(make("clipPath", { id: `clip-${name}` }));
    this.clip = clip.appendChild(make("rect", {}));
    const group = this.over.appendChild(make("g", { "clip-path": `url(#clip-${name})` }));
    this.band = group.appendChild(make("path", { fill: "#56b4e9", "fill-opacity": 0.35, stroke: "none" }));
    this.dots = group.appendChild(make("path", { fill: "none", stroke: options.ink, "stroke-width": 5, "stroke-linecap": "round" }));
    this.path = group.appendChild(make("path", { fill: "none", stroke: options.ink, "stroke-width": options.stems ? 7 : 2.2 }));
    this.handles = this.over.appendChild(make("g", {}));
    this.make = make;
    parent.appendChild(this.box);
    this.now = null; this.corners = null; this.others = []; this.map = null; this.quantiles = null;
    this.ranges = { x: options.x || [0, 1], y: [0, 1] };
    const axis = (title) => ({
      title: { text: title.replaceAll("\n", "<br>"), font: { size: 11 }, standoff: 4 }, gridcolor: "#d9d9d9", zeroline: false, fixedrange: true,
      linecolor: "#000", ticks: "outside", ticklen: 3, tickfont: { size: 10 }, automargin: false,
    });
    this.layout = {
      margin: { l: frame.y.includes("\n") ? 58 : 48, r: 8, t: frame.letters.length ? 16 : 8, b: 34 }, showlegend: false, hovermode: "closest",
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: "#000" },
      xaxis: axis(frame.x), yaxis: axis(frame.y),
      shapes: frame.letters.map(([, x]) => ({ type: "line", x0: x, x1: x, yref: "paper", y0: 0, y1: 1,
        line: { color: "#595959", width: 0.6 } })),
      annotations: frame.letters.map(([text, x]) => ({ text, x, yref: "paper", y: 1, yanchor: "bottom", showarrow: false,
        font: { size: 10, color: "#595959" } })),
    };
    new ResizeObserver(() => this.react()).observe(this.box);
  }

  /** Show the current curve, at once; the axes follow only where it leaves them. */
  draw(now, corners) {
    this.now = now;
    this.corners = corners || null;
    if (this._outgrown()) this.react();
    else this._trace();
  }

  /** Show the curves of other designs, and fit the axes to all of them. */
  compare(others) {
    this.others = others;
    this._fit();
    this.react();
  }

  _lists(axis) {
    const lists = this.others.map((other) => other[axis]);
    if (this.now && !this.map) lists.push(this.now[axis]);
    if (this.corners) lists.push(axis === "x" ? this.corners.x.filter((_, i) => this.corners.y[i] !== null) : this.corners.y);
    if (this.quantiles && axis === "y") lists.push(...this.quantiles.curves);
    return lists;
  }

  _wanted(axis) {
    const { options } = this;
    if (axis === "x" && options.x) return options.x;
    if (this.map) {
      if (axis === "y") return limits([this.map.face]);
      const shift = limits([this.map.ahead]), x = limits([this.map.x]);
      return [x[0] + shift[0], x[1] + shift[1]];
    }
    let found = limits(this._lists(axis)) || [0, 1];
    if (axis === "x") {
      const room = options.stems ? 0.6 : options.down ? 0.02 * (found[1] - found[0]) : 0;
      return [found[0] - room, found[1] + room];
    }
    if (options.zero || options.down) found = [Math.min(0, found[0]), Math.max(0, found[1])];
    if (options.least && found[1] - found[0] < options.least) {
      found = options.zero || options.down ? [found[0], found[0] + options.least]
        : [(found[0] + found[1] - options.least) / 2, (found[0] + found[1] + options.least) / 2];
    }
    const air = AIR * (found[1] - found[0] || 1);
    const range = [found[0] - (options.zero ? 0 : air), found[1] + air];
    return options.down ? range.reverse() : range;
  }

  _fit() { this.ranges = { x: this._wanted("x"), y: this._wanted("y") }; }

  _outgrown() {
    const grown = (axis) => {
      const [a, b] = this.ranges[axis], [c, d] = this._wanted(axis);
      const [low, high, least, most] = [Math.min(a, b), Math.max(a, b), Math.min(c, d), Math.max(c, d)];
      const room = 0.5 * AIR * (high - low);
      if (least >= low - room && most <= high + room) return false;
      const range = [Math.min(low, least), Math.max(high, most + 0.2 * (axis === "y" && !this.map ? most - least : 0))];
      this.ranges[axis] = a > b ? range.reverse() : range;
      return true;
    };
    const x = grown("x"), y = grown("y");
    return x || y;
  }

  /** Let Plotly draw the axes and the other designs. */
  react() {
    const { width, height } = this.box.getBoundingClientRect();
    if (!width || !height) return;
    const data = this.others.map((other) => ({
      x: other.x, y: other.y, name: other.name, type: "scatter", connectgaps: false, line: { color: other.color, width: 1.3, dash: other.dash },
      marker: { color: other.color, size: 6, symbol: "line-ew-open" }, mode: this.options.stems ? "markers" : "lines",
      hovertemplate: "%{x:.4g}, %{y:.5g}<extra>%{fullData.name}</extra>",
    }));
    if (this.now && !this.map) data.push({ x: this.now.x, y: this.now.y, name: "now", type: "scatter", mode: "lines", connectgaps: false,
      line: { color: "rgba(0,0,0,0)", width: 2 }, hovertemplate: "%{x:.4g}, %{y:.5g}<extra>now</extra>" });
    this.layout.width = width;
    this.layout.height = height;
    this.layout.xaxis.range = this.ranges.x.slice();
    this.layout.yaxis.range = this.ranges.y.slice();
    Plotly.react(this.plot, data, this.layout, { displayModeBar: false, responsive: false });
    const { margin } = this.layout;
    this.frame = { left: margin.l, top: margin.t, width: width - margin.l - margin.r, height: height - margin.t - margin.b };
    for (const [key, value] of Object.entries({ x: margin.l, y: margin.t, width: Math.max(this.frame.width, 0), height: Math.max(this.frame.height, 0) })) {
      this.clip.setAttribute(key, value);
    }
    this._trace();
  }

  _scales() {
    const { left, top, width, height } = this.frame;
    return [scale(this.ranges.x, left, left + width), scale(this.ranges.y, top + height, top)];
  }

  _trace() {
    if (!this.frame) return;
    const [x, y] = this._scales();
    if (this.map) this._paint(x, y);
    if (this.now) this.path.setAttribute("d", this.map ? "" : this.options.stems ? this._stems(x, y) : line(this.now, x, y));
    this.dots.setAttribute("d", this.corners ? points(this.corners, x, y) : "");
    this.band.setAttribute("d", this.quantiles ? area(this.quantiles, x, y) : "");
    this._place(x, y);
  }

  _stems(x, y) {
    return this.now.x.map((at, i) => `M${x.at(at).toFixed(1)} ${y.at(0).toFixed(1)}V${y.at(this.now.y[i]).toFixed(1)}`).join("");
  }

  /** Map of the line load: parallelograms, as the contact of helical gears runs ahead over the face. */
  _paint(x, y) {
    const { map, canvas, frame } = this, { width, height } = this.box.getBoundingClientRect();
    const ratio = window.devicePixelRatio || 1;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.save();
    pen.beginPath();
    pen.rect(frame.left, frame.top, frame.width, frame.height);
    pen.clip();
    const most = (limits(map.load) || [0, 1])[1];
    map.load.forEach((row, s) => {
      const low = y.at(map.face[s]), high = y.at(map.face[s + 1]), a = map.ahead[s], b = map.ahead[s + 1];
      for (let i = 0; i < row.length; i++) {
        if (row[i] === null) continue;
        pen.fillStyle = colour(row[i] / most);
        pen.beginPath();
        const from = map.x[i], to = i + 1 < map.x.length ? map.x[i + 1] : 2 * from - map.x[i - 1];
        pen.moveTo(x.at(from + a), low);
        pen.lineTo(x.at(to + a) + 0.6, low);
        pen.lineTo(x.at(to + b) + 0.6, high);
        pen.lineTo(x.at(from + b), high);
        pen.fill();
      }
    });
    pen.restore();
    pen.fillStyle = "#000";
    pen.font = "10px sans-serif";
    pen.textAlign = "right";
    pen.fillText(`largest ${most.toPrecision(4)}`, frame.left + frame.width - 4, frame.top + frame.height - 5);
  }

  /** Handles that can be dragged: [{id, label, x, y, drag(dx, dy)}] in units of the data. */
  setHandles(wanted) {
    const known = new Map([...this.handles.children].map((node) => [node.dataset.id, node]));
    for (const each of wanted) {
      let node = known.get(each.id);
      known.delete(each.id);
      if (!node) {
        node = this.make("circle", { r: 6.5, class: "handle", tabindex: 0, role: "slider", "aria-label": each.label });
        node.dataset.id = each.id;
        this._listen(node);
        this.handles.appendChild(node);
      }
      node.held = each;
    }
    for (const node of known.values()) node.remove();
    if (this.frame) this._place(...this._scales());
  }

  _place(x, y) {
    for (const node of this.handles.children) {
      node.setAttribute("cx", x.at(node.held.x).toFixed(1));
      node.setAttribute("cy", y.at(node.held.y).toFixed(1));
    }
  }

  _listen(node) {
    let last = null;
    node.addEventListener("pointerdown", (event) => {
      node.setPointerCapture(event.pointerId);
      last = [event.clientX, event.clientY];
      node.held.began();
      event.preventDefault();
      node.focus();
    });
    node.addEventListener("pointermove", (event) => {
      if (!last) return;
      const [x, y] = this._scales();
      node.held.drag((event.clientX - last[0]) * x.per, (event.clientY - last[1]) * y.per);
      last = [event.clientX, event.clientY];
    });
    for (const kind of ["pointerup", "pointercancel"]) node.addEventListener(kind, () => { if (last) { last = null; node.held.ended(); } });
    node.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: [-4, 0], ArrowRight: [4, 0], ArrowUp: [0, -4], ArrowDown: [0, 4] }[event.key];
      if (!way) return;
      const [x, y] = this._scales();
      node.held.drag(way[0] * x.per, way[1] * y.per);
      node.held.ended();
      event.preventDefault();
    });
  }
}

function line(curve, x, y) {
  let found = "", pen = "M";
  for (let i = 0; i < curve.x.length; i++) {
    if (curve.y[i] === null) { pen = "M"; continue; }
    found += `${pen}${x.at(curve.x[i]).toFixed(1)} ${y.at(curve.y[i]).toFixed(1)}`;
    pen = "L";
  }
  return found;
}

function points(curve, x, y) {
  let found = "";
  for (let i = 0; i < curve.x.length; i++) {
    if (curve.y[i] !== null) found += `M${x.at(curve.x[i]).toFixed(1)} ${y.at(curve.y[i]).toFixed(1)}h0`;
  }
  return found;
}

function area({ x: places, curves }, x, y) {
  const forth = curves[0].map((value, i) => `${x.at(places[i]).toFixed(1)} ${y.at(value).toFixed(1)}`);
  const back = curves[curves.length - 1].map((value, i) => `${x.at(places[i]).toFixed(1)} ${y.at(value).toFixed(1)}`).reverse();
  return `M${forth.concat(back).join("L")}Z`;
}

// cividis, reversed, in nine steps
const STEPS = [[253, 231, 55], [222, 205, 71], [189, 178, 88], [158, 153, 103], [128, 129, 116], [100, 106, 117], [71, 84, 108], [38, 62, 106], [0, 34, 78]];

function colour(share) {
  const at = Math.min(Math.max(share, 0), 1) * (STEPS.length - 1), i = Math.min(Math.floor(at), STEPS.length - 2), t = at - i;
  const [r, g, b] = STEPS[i].map((value, k) => Math.round(value + t * (STEPS[i + 1][k] - value)));
  return `rgb(${r},${g},${b})`;
}
