// What is said in words. Every text goes in as text: nothing of a log is ever markup.

const MOST_LISTED = 400;
const byId = (id) => document.getElementById(id);

function fillPage(model, colors) {
  document.title = model.title + " · hil view";
  byId("title").textContent = model.title;
  byId("source").textContent = model.source;
  byId("facts").replaceChildren(
    ...model.facts.map(([value, text]) => {
      const item = element("li");
      item.append(element("b", value), element("span", text));
      return item;
    }),
  );
  byId("notes").replaceChildren(...model.notes.map((text) => element("p", text, "note")));
  byId("said").replaceChildren(...model.said.map((text) => element("p", text)));
  fillTerms(byId("about-list"), model.about);
  fillLessons(model, colors);
}

function fillTerms(list, terms) {
  list.replaceChildren(...terms.flatMap(([name, value]) => [element("dt", name), element("dd", value)]));
}

function fillLegend(model) {
  const kinds = new Set([...model.tracks.values()].map((track) => track.kind));
  const words = [];
  if (kinds.has("junior")) words.push(["swatch junior", "J: Junior, the triangle its nose"]);
  if (kinds.has("opponent")) words.push(["swatch opponent", "O: the opponent"]);
  if (kinds.has("junior")) words.push(["swatch beam", "what an eye covers, edged when it sees"], ["swatch touch", "an arm touches, or a floor sensor is off the ring"]);
  if (kinds.has("ranger")) words.push(["swatch round junior", "RANGER (disc)"]);
  if (kinds.has("wild")) words.push(["swatch opponent", "WILD (square)"]);
  if (kinds.has("robot")) words.push(["swatch round robot", "robot"]);
  if (kinds.has("ranger") || kinds.has("wild") || kinds.has("robot")) words.push(["swatch ring", "touches something"]);
  byId("legend").replaceChildren(
    ...words.map(([swatch, text]) => {
      const item = element("span", undefined, "item");
      item.append(element("i", undefined, swatch), element("span", text));
      return item;
    }),
  );
}

function fillBouts(model, onPick, over) {
  const section = byId("bouts");
  section.hidden = model.chapters.length < 2 && !model.chapters.some((one) => one.outcome);
  if (section.hidden) return [];
  section.querySelector("h2").textContent = model.chapters.some((one) => one.name.startsWith("Bout")) ? "Bouts" : "Runs";
  const fewer = model.chapters.length < model.played;
  byId("bout-words").hidden = !fewer;
  const later = model.all && ` All${over ? "" : " of them, after the run"}: ${model.all}`;
  byId("bout-words").textContent = `Listed here, and under Events, ${model.chapters.length === 1 ? "is the bout that was" : `are the ${model.chapters.length} bouts that were`} shown, of ${model.played.toLocaleString("en")}${over ? "" : " so far"}.${later}`;
  const counts = new Map();
  for (const { outcome } of model.chapters) if (outcome) counts.set(outcome, (counts.get(outcome) || 0) + 1);
  byId("bout-key").textContent = [...counts].map(([outcome, count]) => `${own(OUTCOMES, outcome)?.sign || ""} ${count} ${outcome}`).join("   ");
  const list = byId("bout-list");
  list.replaceChildren();
  let series = null;
  let group = null;
  return model.chapters.map((chapter, index) => {
    if (chapter.series !== series) {
      series = chapter.series;
      if (series && series !== "surround") list.append(element("h3", series));
      group = element("div", undefined, "chips");
      list.append(group);
    }
    const sign = own(OUTCOMES, chapter.outcome)?.sign || "";
    const short = chapter.name.replace(/^Bout /, "");
    const chip = element("button", sign ? `${sign} ${short}` : short, "chip " + (own(OUTCOMES, chapter.outcome) ? chapter.outcome.replace(" ", "-") : "none"));
    chip.title = `${chapter.name}${chapter.outcome ? ", " + chapter.outcome : ""}, ${seconds(chapter.end - chapter.begin)}`;
    chip.setAttribute("aria-label", chip.title);
    chip.addEventListener("click", () => onPick(index));
    group.append(chip);
    return chip;
  });
}

function fillLessons(model, colors) {
  byId("lessons").hidden = !model.lessons.length;
  byId("lesson-list").replaceChildren(
    ...model.lessons.map((lesson) => {
      const box = element("article", undefined, "lesson");
      box.append(element("h3", lesson.when));
      if (lesson.steps.length) box.append(strip(lesson.steps, colors));
      box.append(element("p", lesson.does), element("p", lesson.worth, "soft small"));
      if (lesson.why.length) {
        const why = element("details");
        why.append(element("summary", "Why this one"), ...lesson.why.map((text) => element("p", text, "small")));
        box.append(why);
      }
      return box;
    }),
  );
}

// How fast each wheel turns in each action: a bar up is forward, down is backward.
function strip(steps, colors) {
  const canvas = document.createElement("canvas");
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", steps.map((step) => step[0] + ": " + step[1]).join("; "));
  const [cell, height] = [64, 78];
  const context = sized(canvas, cell * steps.length + 16, height);
  context.font = "11px " + colors("--font");
  context.textAlign = "center";
  context.fillStyle = colors("--soft");
  context.fillText("L", 6, 20);
  context.fillText("R", 6, 52);
  steps.forEach(([name, , left, right], index) => {
    const x = 16 + cell * index;
    for (const [share, middle, color] of [[left, 16, "--junior"], [right, 48, "--opponent"]]) {
      context.fillStyle = colors("--band");
      context.fillRect(x, middle - 13, cell - 4, 26);
      context.fillStyle = colors(color);
      context.fillRect(x + 12, middle - Math.max(0, share) * 12, cell - 28, Math.abs(share) * 12 || 0);
      context.fillStyle = colors("--soft");
      context.fillRect(x, middle - 0.5, cell - 4, 1);
    }
    context.fillStyle = colors("--ink");
    context.fillText(name, x + cell / 2 - 2, height - 4);
  });
  return canvas;
}

class Events {
  constructor(model, onSeek) {
    Object.assign(this, { model, onSeek, hidden: new Set(["decision"]) }); // there is one for every maneuver
    this.begin();
  }

  begin() {
    const { model } = this;
    byId("events").hidden = !model.marks.length;
    const counts = new Map();
    for (const { kind } of model.marks) counts.set(kind, (counts.get(kind) || 0) + 1);
    byId("event-kinds").replaceChildren(
      ...[...counts.entries()].slice(0, 24).map(([kind, count]) => {
        const label = element("label", undefined, "kind");
        const box = document.createElement("input");
        box.type = "checkbox";
        box.checked = !this.hidden.has(kind);
        box.addEventListener("change", () => {
          if (box.checked) this.hidden.delete(kind);
          else this.hidden.add(kind);
          this.fill();
        });
        label.append(box, element("span", `${(own(MARKS, kind) || OTHER_MARK).sign} ${kind} (${count})`));
        return label;
      }),
    );
    this.fill();
  }

  get shown() {
    return this.model.marks.filter((mark) => !this.hidden.has(mark.kind));
  }

  fill() {
    const marks = this.shown;
    this.items = marks.slice(0, MOST_LISTED).map((mark) => {
      const item = element("li");
      const jump = element("button", undefined, "event");
      jump.append(element("span", seconds(mark.time, 2), "time"), element("span", (own(MARKS, mark.kind) || OTHER_MARK).sign + " " + mark.kind, "what"), element("span", mark.text));
      jump.addEventListener("click", () => this.onSeek(mark.time));
      item.append(jump);
      return item;
    });
    byId("event-list").replaceChildren(...this.items);
    const more = marks.length - this.items.length;
    byId("event-more").textContent = more > 0 ? `and ${more.toLocaleString("en")} more, which the marks over the time axis show: choose fewer kinds to list them` : "";
  }
}

// What holds at a time, in words.
function nowTerms(model, time, picked) {
  const terms = [];
  const chapter = model.chapters[model.chapterAt(time)];
  if (chapter && time <= chapter.end + 0.05) {
    terms.push([chapter.name.startsWith("Run") ? "Run" : "Bout", `${chapter.name.replace(/^(Bout|Run) /, "")}${chapter.series && chapter.series !== "surround" ? `, ${chapter.series}` : ""}: ${seconds(Math.max(0, time - chapter.begin))} of ${seconds(chapter.end - chapter.begin)}`]);
  } else if (model.chapters.length) terms.push(["Bout", "between bouts"]);
  for (const lane of model.lanes.values()) {
    const at = model.stretchAt(lane, time);
    const code = at < 0 ? -1 : lane.code[at];
    const said = code < 0 ? "–" : lane.meanings[code] || lane.words[code];
    terms.push([lane.name, code < 0 ? "–" : lane.name.startsWith("Maneuver") ? `${lane.words[code].split(" · ")[0]}: ${said}` : said]);
  }
  const track = picked && model.tracks.get(picked);
  if (track) terms.push(...robotTerms(track, time));
  const stands = [...model.traces.values()].filter((trace) => !trace.name.startsWith("Wheels") && !trace.name.startsWith("Floor") && !trace.name.startsWith("Eyes"));
  for (const trace of stands.slice(0, 3)) {
    const at = rowAt(trace.t, time);
    if (at < 0) continue;
    const values = trace.labels.map((label, index) => `${trace.labels.length > 1 ? label + " " : ""}${Number.isNaN(trace.values[index][at]) ? "–" : shown(trace.values[index][at], trace.digits)}${trace.unit ? "\u00a0" + trace.unit : ""}`);
    terms.push([trace.name, values.join(", ")]);
  }
  return terms;
}

function robotTerms(track, time) {
  const pose = {};
  if (!poseAt(track, time, pose) || !track.poses.flags) return [];
  const flags = track.poses.flags[pose.row];
  const seen = ["near0", "near1"].map((name) => bitCount(track.poses[name] ? track.poses[name][pose.row] : 0));
  const contact = flags & 1 ? "touches something ahead" : flags & 2 ? "touches something" : "touches nothing";
  return [
    ["Picked", `${track.label} at ${pose.x.toFixed(3)}, ${pose.y.toFixed(3)} m; ${contact}`],
    ["It senses", `RANGERs in ${seen[0]} and WILDs in ${seen[1]} of its sectors`],
  ];
}

function bitCount(mask) {
  let count = 0;
  for (let rest = mask; rest; rest &= rest - 1) count++;
  return count;
}
