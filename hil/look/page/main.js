// Puts the page together.

class View {
  constructor(model, live = null) {
    this.model = model;
    this.live = live;
    this.shades = new Map();
    this.colors = (name) => this.shade(name);
    this.arena = new Arena(byId("arena"), model, this.colors);
    this.player = new (live ? LivePlayer : Player)(model, (time) => this.tell(time), (from, to) => this.show(from, to), live);
    this.overview = new Overview(byId("overview"), model, this.colors);
    this.bands = [];
    this.addBands();
    this.traces = new Traces(byId("traces"), model, this.colors, (time) => this.player.seek(time), (from, to) => this.player.closer(from, to));
    this.toldAt = 0;
    this.told = null;
  }

  // A colour of the style sheet, as light or dark has it.
  shade(name) {
    let found = this.shades.get(name);
    if (found === undefined) {
      found = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
      this.shades.set(name, found);
    }
    return found;
  }

  addBands() {
    for (const lane of [...this.model.lanes.values()].slice(this.bands.length)) this.bands.push(new Band(byId("lanes"), lane, this.colors));
  }

  // What is there at all, and all that stands in words.
  fill() {
    const { model, player } = this;
    byId("arena-box").hidden = !model.terrain;
    document.body.classList.toggle("bare", !model.terrain);
    fillPage(model, this.colors);
    fillLegend(model);
    this.several = new Set(model.chapters.map((one) => one.series)).size > 1;
    this.chips = fillBouts(model, (index) => {
      player.chapter(index);
      player.toggle(true);
    }, !this.live || this.live.over);
    this.fillRobots();
    byId("curves").hidden = !model.curves.size;
  }

  open() {
    const { model, player } = this;
    byId("main").hidden = byId("play").hidden = false;
    this.fill();
    this.events = new Events(model, (time) => player.seek(time));
    byId("axis-words").textContent = "Click to go there, drag to look closer, double-click for all of it. The line is now.";
    this.controls();
    this.layOut();
    addEventListener("resize", () => this.later());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.repaint());
  }

  later() {
    cancelAnimationFrame(this.waiting);
    this.waiting = requestAnimationFrame(() => this.layOut());
  }

  repaint() {
    this.shades.clear();
    fillPage(this.model, this.colors);
    this.layOut();
  }

  layOut() {
    const { from, to, time } = this.player;
    this.arena.resize();
    this.traces.build(from, to);
    this.curves = drawCurves(byId("curve-list"), this.model, this.colors);
    this.show(from, to);
    this.tell(time);
  }

  // The run has gone on: what has changed is shown, and no more is built anew than has to be.
  goOn() {
    const { model, player } = this;
    const { terrain } = model;
    const words = [model.title, model.said, model.facts, model.notes, model.about, model.lessons, model.chapters, model.played, this.live?.over, [...model.tracks.keys()], terrain];
    const [said, drawn, marks] = [JSON.stringify(words), JSON.stringify([terrain, [...model.tracks.keys()]]), model.marks.length];
    if (drawn !== this.drawnBefore) {
      this.arena.arrange();
      byId("arena-box").hidden = !terrain; // it has a width from here on
      this.arena.resize();
    }
    if (said !== this.saidBefore) this.fill();
    if (marks !== this.marksBefore) this.events.begin();
    [this.saidBefore, this.drawnBefore, this.marksBefore] = [said, drawn, marks];
    this.addBands();
    this.traces.goOn(player.from, player.to);
    if (model.curves.size && performance.now() - (this.curvesAt || -1e9) > 900) {
      this.curvesAt = performance.now();
      this.curves = drawCurves(byId("curve-list"), model, this.colors);
    }
    this.show(player.from, player.to);
  }

  fillRobots() {
    const tracks = [...this.model.tracks.values()].filter((track) => ["ranger", "wild", "robot"].includes(track.kind));
    byId("robots").hidden = !tracks.length;
    const none = element("option", "none");
    none.value = "";
    byId("pick").replaceChildren(
      none,
      ...tracks.map((track) => {
        const option = element("option", track.label);
        option.value = track.key;
        return option;
      }),
    );
    this.keys = tracks.map((track) => track.key);
  }

  pick(key) {
    this.arena.picked = key || null;
    byId("pick").value = key || "";
    this.tell(this.player.time);
  }

  controls() {
    const { player } = this;
    const press = (id, act) => byId(id).addEventListener("click", act);
    press("toggle", () => player.toggle());
    press("step-back", () => this.step(-FRAME));
    press("step-on", () => this.step(FRAME));
    press("chapter-back", () => player.chapterBefore());
    press("chapter-on", () => player.chapterOn());
    press("window", () => player.setWhole(!player.whole));
    const slider = byId("slider");
    slider.addEventListener("input", () => player.seek(player.from + Number(slider.value) * (player.to - player.from), { stay: true }));
    const speed = byId("speed");
    speed.replaceChildren(
      ...SPEEDS.map((one) => {
        const option = element("option", one + "×");
        option.value = one;
        return option;
      }),
    );
    speed.value = "1";
    speed.addEventListener("change", () => {
      player.speed = Number(speed.value);
    });
    byId("pick").addEventListener("change", () => this.pick(byId("pick").value));
    byId("arena").addEventListener("click", (event) => {
      if (!this.keys.length) return;
      const box = byId("arena").getBoundingClientRect();
      this.pick(this.arena.nearest(event.clientX - box.left, event.clientY - box.top));
    });
    const overview = byId("overview");
    overview.addEventListener("click", (event) => player.seek(this.overview.timeAt(event.clientX - overview.getBoundingClientRect().left)));
    byId("lanes").addEventListener("click", (event) => {
      const wide = byId("lanes").clientWidth - GUTTER - 8;
      const share = (event.clientX - byId("lanes").getBoundingClientRect().left - GUTTER) / wide;
      if (share >= 0) player.seek(player.from + Math.min(1, share) * (player.to - player.from));
    });
    byId("traces").addEventListener("dblclick", () => player.setWhole(player.whole));
    document.addEventListener("keydown", (event) => this.key(event));
    // Who clicks with a pointer goes on with the keys of the player, not with those of the button.
    document.addEventListener("click", (event) => event.detail && event.target.closest("button")?.blur());
    document.addEventListener("change", (event) => event.target.tagName === "SELECT" && event.target.blur());
  }

  step(by) {
    this.player.toggle(false);
    this.player.seek(this.player.time + by);
  }

  key(event) {
    const { player } = this;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const on = event.target.tagName;
    if (on === "SELECT" || (on === "BUTTON" && (event.key === " " || event.key === "Enter"))) return;
    if (event.key === " " && (on === "SUMMARY" || event.target.type === "checkbox")) return;
    const acts = {
      " ": () => player.toggle(),
      ArrowLeft: () => this.step(event.shiftKey ? -1 : -FRAME),
      ArrowRight: () => this.step(event.shiftKey ? 1 : FRAME),
      "[": () => player.chapterBefore(),
      "]": () => player.chapterOn(),
      ",": () => player.mark(-1, this.events.shown),
      ".": () => player.mark(1, this.events.shown),
      "-": () => player.faster(-1),
      "+": () => player.faster(1),
      "=": () => player.faster(1),
      Home: () => player.seek(player.from),
      End: () => player.seek(player.to),
      w: () => player.setWhole(!player.whole),
      n: () => this.pickBy(1),
      p: () => this.pickBy(-1),
    };
    if (!acts[event.key]) return;
    event.preventDefault();
    acts[event.key]();
    byId("speed").value = String(player.speed);
  }

  pickBy(by) {
    if (!this.keys.length) return;
    const at = this.keys.indexOf(this.arena.picked);
    this.pick(this.keys[(at + by + this.keys.length + (at < 0 && by < 0 ? 1 : 0)) % this.keys.length]);
  }

  // The part of the run that is shown has changed.
  show(from, to) {
    this.overview.draw(from, to);
    for (const band of this.bands) band.draw(from, to);
    this.traces.show(from, to);
    const whole = this.player.whole && this.model.chapters.length > 0;
    byId("window").hidden = !this.model.chapters.length;
    byId("window").textContent = whole ? "This bout" : "Whole run";
    byId("window").setAttribute("aria-pressed", String(whole));
  }

  // The time has changed: the picture at once, words ten times a second.
  tell(time) {
    const { player } = this;
    const { from, to } = player;
    this.arena.draw(time);
    this.overview.point(time);
    for (const band of this.bands) band.point(time, from, to);
    this.traces.point(time, from, to);
    const slider = byId("slider");
    slider.value = String((time - from) / (to - from));
    const now = performance.now();
    if (player.playing && this.toldPlaying && now - this.toldAt < 100) return;
    [this.toldAt, this.toldPlaying] = [now, player.playing];
    this.say(time);
  }

  say(time) {
    const { model, player } = this;
    if (!Number.isFinite(time)) return;
    const text = `${seconds(time, 2)} of ${seconds(model.end)}`;
    byId("clock").textContent = text;
    byId("slider").setAttribute("aria-valuetext", text);
    const toggle = byId("toggle");
    byId("toggle-icon").setAttribute("d", player.playing ? "M4 2h3v12H4zM9 2h3v12H9z" : "M4 2v12l10-6z");
    toggle.setAttribute("aria-label", player.playing ? "Pause" : "Play");
    const terms = nowTerms(model, time, this.arena.picked);
    byId("now").hidden = !terms.length;
    fillTerms(byId("now-list"), terms);
    const at = model.chapterAt(time);
    const chapter = model.chapters[at];
    byId("ending").hidden = !(chapter && chapter.story);
    if (chapter) {
      byId("ending-title").textContent = `How ${chapter.name.replace(/^[BR]/, (letter) => letter.toLowerCase())} ended`;
      byId("story").textContent = chapter.story;
    }
    byId("where").textContent = chapter ? chapter.name + (this.several ? `, ${chapter.series}` : "") : "";
    this.chips.forEach((chip, index) => {
      if ((index === at) !== (chip.getAttribute("aria-current") === "true")) chip.setAttribute("aria-current", String(index === at));
    });
    this.traces.tell(time);
    byId("arena").setAttribute("aria-label", describe(model, time));
  }
}

function describe(model, time) {
  const said = [];
  for (const track of [...model.tracks.values()].slice(0, 4)) {
    const pose = {};
    if (poseAt(track, time, pose)) said.push(`${track.label} at ${pose.x.toFixed(2)}, ${pose.y.toFixed(2)} m`);
  }
  const more = model.tracks.size > 4 ? `, and ${model.tracks.size - 4} more` : "";
  return `The arena at ${seconds(time, 2)}: ${said.join("; ")}${more}`;
}

async function start() {
  try {
    const model = new Model();
    const scene = JSON.parse(byId("scene").textContent);
    if (scene.live) return void new LivePage(scene.live);
    await model.take(scene);
    const view = new View(model);
    view.open();
    globalThis.hilView = view;
  } catch (error) {
    const trouble = byId("trouble");
    trouble.textContent = typeof DecompressionStream === "undefined" ? "This browser is too old to show this page: it needs one of 2023 or later." : `This page cannot be shown: ${error.message}`;
    trouble.hidden = false;
    throw error;
  }
}

start();
