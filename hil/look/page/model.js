// The model: what the page knows of the run. It takes documents as parts, and puts each behind what it has.

async function inflate(text) {
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// A column of numbers; NaN where there is none.
function unpack(bytes, place) {
  const { at, n, b, s, z } = place;
  const found = new Float64Array(n);
  let whole = 0;
  for (let row = 0; row < n; row++) {
    let apart = 0;
    for (let byte = 0; byte < b; byte++) apart |= bytes[at + byte * n + row] << (8 * byte);
    const shift = 32 - 8 * b;
    whole += (apart << shift) >> shift;
    found[row] = whole === z ? NaN : whole * s;
  }
  return found;
}

function behind(first, second) {
  if (!first || !first.length) return second;
  if (!second.length) return first;
  const joined = new Float64Array(first.length + second.length);
  joined.set(first);
  joined.set(second, first.length);
  return joined;
}

// A table with another behind it; a column that one of them lacks has holes there.
function joined(first, second) {
  if (!first.t || !first.t.length) return second;
  const table = {};
  for (const name of new Set([...Object.keys(first), ...Object.keys(second)])) {
    const none = (rows) => new Float64Array(rows.t.length).fill(NaN);
    table[name] = behind(first[name] || none(first), second[name] || none(second));
  }
  return table;
}

const NEAR = 5e-4; // seconds: half of what times are rounded to

// How many rows stand before a time.
function rowBefore(times, time) {
  return times ? rowAt(times, time - NEAR) + 1 : 0;
}

// The rows of a table before a time.
function before(table, time) {
  const kept = rowBefore(table.t, time);
  return Object.fromEntries(Object.entries(table).map(([name, values]) => [name, values.subarray(0, kept)]));
}

// The last row at or before a time; -1: none.
function rowAt(times, time) {
  let low = 0;
  let high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

// What a table has under a name that a log may have chosen.
function own(table, name) {
  return Object.hasOwn(table, name) ? table[name] : undefined;
}

class Model {
  constructor() {
    this.title = this.source = "";
    this.said = [];
    this.facts = [];
    this.notes = [];
    this.about = [];
    this.begin = Infinity;
    this.end = -Infinity;
    this.terrain = null;
    this.tracks = new Map();
    this.traces = new Map();
    this.lanes = new Map();
    this.marks = [];
    this.chapters = [];
    this.curves = new Map();
    this.lessons = [];
    this.played = 0; // bouts of the whole run, where fewer of them are told
    this.all = ""; // the command that shows all of them
  }

  async take(part) {
    if (part.version !== 1) throw new Error("the page was made by another version of hil");
    const bytes = await inflate(part.columns);
    const column = (place) => unpack(bytes, place);
    for (const name of ["title", "source"]) if (part[name]) this[name] = part[name];
    for (const name of ["said", "facts", "notes", "about", "lessons"]) if (part[name].length) this[name] = part[name];
    this.played = part.played || this.played;
    this.all = part.all || this.all;
    if (part.terrain) {
      const [ground, width, height, wall, obstacles] = part.terrain;
      this.terrain = { ground, width, height, wall, obstacles };
    }
    if (part.since !== undefined) this.forget(part.since);
    this.begin = Math.min(this.begin, part.begin);
    this.end = Math.max(this.end, part.end);
    for (const track of part.tracks) this.takeTrack(track, part.shapes[track.shape], column);
    for (const trace of part.traces) this.takeTrace(trace, column);
    for (const lane of part.lanes) this.takeLane(lane, column);
    this.marks = this.marks.concat(part.marks.map(([time, kind, text]) => ({ time, kind, text })));
    for (const chapter of part.chapters) {
      const same = this.chapters.findIndex((one) => one.begin === chapter.begin);
      if (same < 0) this.chapters.push(chapter);
      else this.chapters[same] = chapter;
    }
    for (const curve of part.curves) {
      this.curves.set(curve.name, { ...curve, x: curve.x.map(column), y: curve.y.map(column) });
    }
  }

  // What was told from a moment on is told anew.
  forget(since) {
    for (const track of this.tracks.values()) for (const table of ["poses", "senses", "rays"]) track[table] = before(track[table], since);
    for (const trace of this.traces.values()) {
      const kept = rowBefore(trace.t, since);
      trace.t = trace.t.subarray(0, kept);
      trace.values = trace.values.map((values) => values.subarray(0, kept));
    }
    for (const lane of this.lanes.values()) {
      const kept = rowBefore(lane.begin, since);
      for (const name of ["begin", "end", "code"]) lane[name] = lane[name].subarray(0, kept);
      if (kept && lane.end[kept - 1] > since) lane.end[kept - 1] = since;
    }
    this.marks = this.marks.filter((mark) => mark.time < since - NEAR);
    this.chapters = this.chapters.filter((chapter) => chapter.begin < since - NEAR);
  }

  takeTrack(told, shape, column) {
    const track = this.tracks.get(told.key) || { key: told.key, poses: {}, senses: {}, rays: {} };
    track.label = told.label;
    track.kind = told.kind;
    track.shape = shape;
    for (const table of ["poses", "senses", "rays"]) {
      const added = Object.fromEntries(Object.entries(told[table] || {}).map(([name, place]) => [name, column(place)]));
      if (added.t) track[table] = joined(track[table], added);
    }
    track.fan = Object.keys(track.rays).filter((name) => /^r\d+$/.test(name)).map((_, ray) => track.rays["r" + ray]);
    this.tracks.set(track.key, track);
  }

  takeTrace(told, column) {
    const trace = this.traces.get(told.name) || { t: new Float64Array(0), labels: [], values: [] };
    const labels = [...trace.labels, ...told.labels.filter((label) => !trace.labels.includes(label))];
    const by = (one, values) => Object.fromEntries([["t", one.t], ...one.labels.map((label, index) => ["=" + label, values[index]])]);
    const added = by({ t: column(told.t), labels: told.labels }, told.values.map(column));
    const table = joined(by(trace, trace.values), added);
    const values = labels.map((label) => table["=" + label] || new Float64Array(table.t.length).fill(NaN));
    this.traces.set(told.name, { ...told, labels, t: table.t, values });
  }

  takeLane(told, column) {
    const lane = this.lanes.get(told.name) || { name: told.name, begin: null, end: null, code: null, words: [], meanings: [], tones: [] };
    const known = new Map(lane.words.map((word, index) => [[word, lane.meanings[index], lane.tones[index]].join("\n"), index]));
    const codes = told.words.map((word, index) => {
      const key = [word, told.meanings[index], told.tones[index]].join("\n");
      if (!known.has(key)) {
        known.set(key, lane.words.length);
        lane.words.push(word);
        lane.meanings.push(told.meanings[index]);
        lane.tones.push(told.tones[index]);
      }
      return known.get(key);
    });
    const [begin, end, code] = [column(told.begin), column(told.end), column(told.code).map((one) => codes[one])];
    const last = lane.begin ? lane.begin.length - 1 : -1;
    const goesOn = last >= 0 && begin.length && code[0] === lane.code[last] && begin[0] - lane.end[last] < NEAR;
    if (goesOn) lane.end[last] = end[0];
    const from = goesOn ? 1 : 0;
    lane.begin = behind(lane.begin, begin.subarray(from));
    lane.end = behind(lane.end, end.subarray(from));
    lane.code = behind(lane.code, code.subarray(from));
    this.lanes.set(told.name, lane);
  }

  chapterAt(time) {
    let found = -1;
    for (let index = 0; index < this.chapters.length && this.chapters[index].begin <= time + 1e-6; index++) found = index;
    return found;
  }

  // What a lane says at a time: an index of its stretches; -1: nothing.
  stretchAt(lane, time) {
    const at = rowAt(lane.begin, time);
    return at >= 0 && time <= lane.end[at] ? at : -1;
  }
}

// Where a body is: into `out`; false where nobody knows yet.
function poseAt(track, time, out) {
  const poses = track.poses;
  const times = poses.t;
  let at = rowAt(times, time);
  if (at < 0) {
    if (!times.length) return false;
    at = 0;
  }
  const next = at + 1;
  let share = 0;
  if (next < times.length && time > times[at] && !(poses.gap && poses.gap[next] > 0)) {
    share = (time - times[at]) / (times[next] - times[at]);
  }
  out.row = at;
  out.x = poses.x[at];
  out.y = poses.y[at];
  out.heading = poses.heading[at];
  out.age = time - times[at];
  if (share > 0) {
    out.x += share * (poses.x[next] - out.x);
    out.y += share * (poses.y[next] - out.y);
    let turn = poses.heading[next] - out.heading;
    if (turn > Math.PI) turn -= 2 * Math.PI;
    else if (turn < -Math.PI) turn += 2 * Math.PI;
    out.heading += share * turn;
  }
  return true;
}

function flagsAt(track, time, pose) {
  const table = track.senses.flags ? track.senses : track.poses.flags ? track.poses : null;
  if (!table) return 0;
  const at = table === track.poses && pose ? pose.row : rowAt(table.t, time);
  return at < 0 ? 0 : table.flags[at];
}
