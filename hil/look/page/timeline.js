// What goes over time: the whole run at a glance, bands, and curves, all on one time axis.

const GUTTER = 64; // pixels left of every plot, where its numbers stand
const OUTCOMES = {
  won: { sign: "✓", color: "--good" },
  lost: { sign: "✗", color: "--bad" },
  drawn: { sign: "=", color: "--drawn" },
  "broken off": { sign: "–", color: "--quiet" },
};
const MARKS = {
  safety: { sign: "■", color: "--bad" },
  fault: { sign: "◆", color: "--bad" },
  refused: { sign: "▲", color: "--bad" },
  link: { sign: "○", color: "--junior" },
  key: { sign: "▼", color: "--ink" },
  operator: { sign: "▼", color: "--ink" },
  robot: { sign: "◇", color: "--fourth" },
  decision: { sign: "·", color: "--soft" },
  series: { sign: "▸", color: "--ink" },
  bout: { sign: "●", color: "--soft" },
};
const OTHER_MARK = { sign: "·", color: "--soft" };
const TONES = { quiet: "--quiet", even: "--even", busy: "--busy", good: "--good", bad: "--bad" };
const DASHES = [[], [6, 4], [2, 3], [8, 3, 2, 3]];
const CURVE_COLORS = ["--junior", "--opponent", "--third", "--fourth", "--fifth", "--sixth"];

function element(tag, text, className) {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
}

function seconds(value, digits = 1) {
  if (Math.abs(value) < 100) return value.toFixed(digits) + "\u00a0s";
  const whole = Math.floor(value / 60);
  return whole + ":" + (value - 60 * whole).toFixed(digits).padStart(digits ? 3 + digits : 2, "0");
}

function sized(canvas, width, height) {
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  canvas.style.width = width + "px";
  canvas.style.height = height + "px";
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return context;
}

// The whole run: bouts by how they ended, events, and what part of it is shown below.
class Overview {
  constructor(canvas, model, colors) {
    Object.assign(this, { canvas, model, colors });
    this.head = element("div", undefined, "head");
    canvas.parentElement.append(this.head);
  }

  x(time) {
    const { begin, end } = this.model;
    return GUTTER + ((time - begin) / Math.max(end - begin, 1e-9)) * (this.width - GUTTER - 8);
  }

  timeAt(x) {
    const { begin, end } = this.model;
    return begin + Math.min(1, Math.max(0, (x - GUTTER) / (this.width - GUTTER - 8))) * (end - begin);
  }

  draw(from, to) {
    const { model, colors } = this;
    this.width = this.canvas.parentElement.clientWidth;
    const context = sized(this.canvas, this.width, 44);
    context.font = "11px " + colors("--font");
    context.fillStyle = colors("--soft");
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.fillText("Whole run", 0, 14);
    context.fillStyle = colors("--band");
    context.fillRect(GUTTER, 4, this.width - GUTTER - 8, 20);
    context.textAlign = "center";
    for (const { begin, end, outcome } of model.chapters) {
      const { sign, color } = own(OUTCOMES, outcome) || { sign: "", color: "--even" };
      const [left, right] = [this.x(begin), this.x(end)];
      const wide = Math.max(1, right - left - (right - left > 4 ? 1 : 0));
      context.fillStyle = colors(color);
      const low = outcome === "lost" ? 8 : outcome === "won" ? 4 : 12; // the height says it as well
      context.fillRect(left, low, wide, 24 - low);
      if (wide > 11 && sign) {
        context.fillStyle = colors("--on-tone");
        context.fillText(sign, left + wide / 2, 16);
      }
    }
    for (const mark of model.marks) {
      if (mark.kind === "decision") continue; // there is one for every maneuver
      const { color } = own(MARKS, mark.kind) || OTHER_MARK;
      context.fillStyle = colors(color);
      context.fillRect(Math.round(this.x(mark.time)), 27, 1.5, mark.kind === "safety" || mark.kind === "fault" ? 10 : 6);
    }
    context.strokeStyle = colors("--ink");
    context.lineWidth = 1.5;
    context.strokeRect(this.x(from) - 0.5, 1.5, Math.max(3, this.x(to) - this.x(from) + 1), 38);
  }

  point(time) {
    this.head.style.transform = `translateX(${this.x(time)}px)`;
  }
}

// One band: what was when.
class Band {
  constructor(parent, lane, colors) {
    Object.assign(this, { lane, colors });
    this.box = element("div", undefined, "lane");
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", lane.name + " over time");
    this.head = element("div", undefined, "head");
    this.box.append(this.canvas, this.head);
    parent.append(this.box);
  }

  draw(from, to) {
    const { lane, colors } = this;
    const width = this.box.clientWidth;
    this.width = width;
    const context = sized(this.canvas, width, 26);
    const wide = width - GUTTER - 8;
    context.font = "11px " + colors("--font");
    context.textBaseline = "middle";
    context.textAlign = "left";
    context.fillStyle = colors("--soft");
    wrapped(lane.name, 11).forEach((line, row, lines) => context.fillText(line, 0, 13 + 11 * (row - (lines.length - 1) / 2), GUTTER - 6));
    context.fillStyle = colors("--band");
    context.fillRect(GUTTER, 3, wide, 20);
    context.save();
    context.beginPath();
    context.rect(GUTTER, 0, wide, 26);
    context.clip();
    const x = (time) => GUTTER + ((time - from) / (to - from)) * wide;
    let drawnTo = -Infinity;
    for (let at = Math.max(0, rowAt(lane.begin, from)); at < lane.begin.length && lane.begin[at] <= to; at++) {
      const [left, right] = [x(lane.begin[at]), x(lane.end[at])];
      if (right < drawnTo + 0.5 && right - left < 0.5) continue;
      drawnTo = right;
      const code = lane.code[at];
      context.fillStyle = colors(own(TONES, lane.tones[code]) || "--even");
      context.fillRect(left, 3, Math.max(1, right - left - 1), 20);
      const room = right - Math.max(left, GUTTER) - 6;
      const word = [lane.meanings[code], lane.words[code]].find((one) => one && room > 8 && context.measureText(one).width < room);
      if (word) {
        context.fillStyle = colors("--on-tone");
        context.fillText(word, Math.max(left, GUTTER) + 4, 13.5);
      }
    }
    context.restore();
  }

  point(time, from, to) {
    this.head.style.transform = `translateX(${headX(time, from, to, this.width)}px)`;
  }
}

function headX(time, from, to, width) {
  const share = (time - from) / (to - from);
  return share < -0.001 || share > 1.001 ? -99 : GUTTER + share * (width - GUTTER - 8);
}

function wrapped(text, letters) {
  const lines = [""];
  for (const word of text.split(" ")) {
    const last = lines[lines.length - 1];
    if (last && last.length + word.length + 1 > letters) lines.push(word);
    else lines[lines.length - 1] = last ? last + " " + word : word;
  }
  return lines.slice(0, 2);
}

// A legend of our own: names by their lines, and values at the time that is shown.
function legendOf(labels, colors) {
  const legend = element("div", undefined, "trace-legend");
  const values = labels.map((label, index) => {
    const item = element("span", undefined, "item");
    const line = document.createElement("canvas");
    const context = sized(line, 22, 8);
    context.strokeStyle = colors(CURVE_COLORS[index % CURVE_COLORS.length]);
    context.lineWidth = 2;
    context.setLineDash(DASHES[index % DASHES.length]);
    context.beginPath();
    context.moveTo(0, 4);
    context.lineTo(22, 4);
    context.stroke();
    const value = element("b", "");
    item.append(line, element("span", label), value);
    legend.append(item);
    return value;
  });
  return [legend, values];
}

function seriesOf(labels, colors, extra = {}) {
  return labels.map((label, index) => ({
    label,
    stroke: () => colors(CURVE_COLORS[index % CURVE_COLORS.length]),
    dash: DASHES[index % DASHES.length],
    width: 1.5,
    points: { show: false },
    ...extra,
  }));
}

function axisOf(colors, more) {
  return { stroke: () => colors("--soft"), grid: { stroke: () => colors("--grid"), width: 1 }, ticks: { show: false }, font: "11px " + colors("--font"), ...more };
}

// Decimals that tell numbers apart which are so far from one another.
function digitsOf(apart) {
  return Math.min(6, Math.max(0, -Math.floor(Math.log10(Math.abs(apart) * 1.001))));
}

function shown(value, digits) {
  return value.toFixed(digits).replace(/^-(0(\.0*)?)$/, "$1");
}

class Traces {
  constructor(parent, model, colors, onSeek, onWindow) {
    Object.assign(this, { parent, model, colors, onSeek, onWindow });
    this.plots = [];
  }

  build(from, to) {
    for (const { plot } of this.plots) plot.destroy();
    this.parent.replaceChildren();
    this.plots = [];
    for (const trace of this.model.traces.values()) this.add(trace, from, to);
  }

  // The same curves, gone on: nothing is built anew where none has come.
  goOn(from, to) {
    const traces = [...this.model.traces.values()];
    const same = traces.length === this.plots.length && traces.every((trace, index) => alike(trace, this.plots[index].trace));
    if (!same) return this.build(from, to);
    this.plots.forEach((one, index) => {
      one.trace = Object.assign(traces[index], { digits: one.trace.digits });
      one.range = rangeOf(one.trace);
      one.plot.setData([one.trace.t, ...one.trace.values.map(holed)], false);
      one.plot.setScale("x", { min: from, max: to });
    });
  }

  add(trace, from, to) {
    const { colors } = this;
    const box = element("div", undefined, "trace");
    const title = element("h3", trace.unit ? `${trace.name} (${trace.unit})` : trace.name);
    const [legend, values] = legendOf(trace.labels, colors);
    const top = element("div", undefined, "trace-top");
    top.append(title, legend);
    if (trace.level !== null && trace.levelName) top.append(element("span", `· · · ${Number(trace.level.toPrecision(4))}: ${trace.levelName}`, "soft small"));
    const under = element("div", undefined, "plot");
    const head = element("div", undefined, "head");
    under.append(head);
    box.append(top, under);
    this.parent.append(box);
    const steps = trace.stepped ? { paths: uPlot.paths.stepped({ align: 1 }) } : {};
    const made = { head, values, trace, range: rangeOf(trace) };
    const [low, high] = made.range;
    trace.digits = trace.values.every((values) => values.every((value) => !(value % 1))) ? 0 : digitsOf((high - low) / 100);
    const plot = new uPlot(
      {
        width: this.parent.clientWidth,
        height: 104,
        padding: [6, 8, 0, 0],
        legend: { show: false },
        cursor: { sync: { key: "time" }, drag: { x: true, y: false, setScale: false }, points: { show: false }, y: false },
        scales: { x: { time: false, range: (_, min, max) => [min, max] }, y: { range: () => made.range } },
        axes: [
          axisOf(colors, { size: 22, space: 70, values: (_, ticks) => ticks.map((tick) => seconds(tick, tick % 1 ? 1 : 0)) }),
          axisOf(colors, { size: GUTTER, space: 26, values: (_, ticks) => ticks.map((tick) => shown(tick, digitsOf(ticks[1] - ticks[0] || 1))) }),
        ],
        series: [{}, ...seriesOf(trace.labels, colors, steps)],
        hooks: {
          setSelect: [
            (u) => {
              if (u.select.width > 4) {
                const [left, right] = [u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x")];
                u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
                this.onWindow(left, right);
              }
            },
          ],
          draw: [(u) => trace.level !== null && drawLevel(u, trace.level, colors("--soft"))],
        },
      },
      [trace.t, ...trace.values.map(holed)],
      under,
    );
    let pressed = 0;
    plot.over.addEventListener("mousedown", (event) => (pressed = event.clientX));
    plot.over.addEventListener("click", (event) => {
      if (Math.abs(event.clientX - pressed) > 4) return; // the end of a drag
      const { left } = plot.over.getBoundingClientRect();
      this.onSeek(plot.posToVal(event.clientX - left, "x"));
    });
    plot.setScale("x", { min: from, max: to });
    made.plot = plot;
    this.plots.push(made);
  }

  show(from, to) {
    for (const { plot } of this.plots) plot.setScale("x", { min: from, max: to });
  }

  resize() {
    const width = this.parent.clientWidth;
    for (const { plot } of this.plots) plot.setSize({ width, height: 104 });
  }

  point(time, from, to) {
    const x = headX(time, from, to, this.parent.clientWidth);
    for (const { head } of this.plots) head.style.transform = `translateX(${x}px)`;
  }

  tell(time) {
    for (const { values, trace } of this.plots) {
      const at = rowAt(trace.t, time);
      values.forEach((cell, index) => {
        const value = at < 0 ? NaN : trace.values[index][at];
        cell.textContent = Number.isNaN(value) ? "–" : shown(value, trace.digits);
      });
    }
  }
}

function alike(one, other) {
  return one.name === other.name && one.level === other.level && one.labels.join("\n") === other.labels.join("\n");
}

// uPlot leaves a hole for null, not for NaN.
function holed(values) {
  return values.some(Number.isNaN) ? Array.from(values, (value) => (Number.isNaN(value) ? null : value)) : values;
}

function rangeOf(trace) {
  let [low, high] = [Infinity, -Infinity];
  for (const values of trace.values) {
    for (const value of values) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (trace.level !== null && low <= high) [low, high] = [Math.min(low, trace.level), Math.max(high, trace.level)];
  if (!(low <= high)) return [0, 1];
  const room = (high - low) * 0.08 || Math.abs(high) * 0.05 || 1;
  return [low - room, high + room];
}

function drawLevel(u, level, color) {
  const y = Math.round(u.valToPos(level, "y", true)) + 0.5;
  const { ctx, bbox } = u;
  ctx.save();
  ctx.strokeStyle = color;
  ctx.lineWidth = 1;
  ctx.setLineDash([2, 4]);
  ctx.beginPath();
  ctx.moveTo(bbox.left, y);
  ctx.lineTo(bbox.left + bbox.width, y);
  ctx.stroke();
  ctx.restore();
}

// Curves over something else than time.
function drawCurves(parent, model, colors) {
  parent.replaceChildren();
  const plots = [];
  for (const curve of model.curves.values()) {
    const box = element("div", undefined, "trace");
    const top = element("div", undefined, "trace-top");
    const [legend] = legendOf(curve.labels, colors);
    top.append(element("h3", curve.unit ? `${curve.name} (${curve.unit})` : curve.name));
    if (curve.labels.length > 1 || curve.labels[0] !== curve.name) top.append(legend);
    const under = element("div", undefined, "plot");
    box.append(top, under, element("p", curve.along, "along"));
    parent.append(box);
    const tables = curve.x.map((x, index) => [x, curve.y[index]]);
    const data = tables.length > 1 ? uPlot.join(tables) : [tables[0][0], holed(tables[0][1])];
    const lone = curve.x.some((x) => x.length < 3);
    const plot = new uPlot(
      {
        width: parent.clientWidth,
        height: 190,
        padding: [8, 12, 0, 0],
        legend: { show: false },
        cursor: { show: false },
        scales: { x: { time: false } },
        axes: [axisOf(colors, { size: 24, space: 60 }), axisOf(colors, { size: GUTTER, space: 30 })],
        series: [{}, ...seriesOf(curve.labels, colors, { spanGaps: true, points: { show: lone, size: 5 } })],
      },
      data,
      under,
    );
    plots.push(plot);
  }
  return plots;
}
