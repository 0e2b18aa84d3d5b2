// A run that goes on: parts come one after the other, and the player follows.

const BEHIND = 0.4; // seconds that the player stays behind, so that there is always something to play
const CHOICES = new Map([ // what may be answered, or done to emulated robots
  ["ready", "Ring is ready"], ["won", "Won"], ["lost", "Lost"], ["drawn", "Drawn"], ["pause", "Pause"], ["resume", "Go on"],
  ["power-off", "Power off"], ["power-on", "Power on"], ["lift", "Lift"], ["put-down", "Put back"],
]);
const LEAST_APART = 25; // milliseconds between two pictures of a run that is as fast as the machine can
const SHOWN = 20; // seconds that are shown of a run without bouts

// What the last bout of a part belongs to.
function sortOf(part) {
  return part.chapters.at(-1)?.series;
}

class LivePlayer extends Player {
  constructor(model, onTime, onWindow, live) {
    super(model, onTime, onWindow);
    Object.assign(this, { live, following: true });
  }

  // To the end, and on from there.
  follow() {
    this.following = true;
    this.zoomed = false;
    this.speed = 1;
    if (!this.live.lockstep) this.time = Math.max(this.model.begin, this.model.end - BEHIND);
    this.live.next(true);
    this.run();
    this.onTime(this.time);
  }

  run() {
    if (this.playing) return;
    [this.playing, this.last] = [true, 0];
    requestAnimationFrame((now) => this.frame(now));
  }

  seek(time, options) {
    this.following = false;
    super.seek(time, options);
  }

  toggle(playing = !this.playing) {
    if (!playing) this.following = false;
    super.toggle(playing);
  }

  setWhole(whole) {
    this.following = false;
    super.setWhole(whole);
  }

  chapter(index) {
    this.following = false;
    super.chapter(index);
  }

  closer(from, to) {
    this.following = false;
    super.closer(from, to);
  }

  // The run and the browser may share the machine: half as many pictures as a screen shows are enough.
  frame(now) {
    if (this.live.lockstep && this.following && this.playing && this.last && now - this.last < LEAST_APART) requestAnimationFrame((next) => this.frame(next));
    else super.frame(now);
  }

  // What is shown while it follows: this bout as far as it has come, or the last seconds.
  spanOf(time) {
    const { model } = this;
    if (!this.following || this.whole !== !model.chapters.length) return super.spanOf(time);
    const chapter = model.chapters[model.chapterAt(time)];
    const from = chapter && chapter.series !== "surround" && chapter.end - chapter.begin < 4 * SHOWN ? chapter.begin : Math.max(model.begin, time - SHOWN);
    const until = this.live.lockstep && chapter ? chapter.end : Math.max(from + 2, Math.min(model.end, time + BEHIND));
    return [from, Math.max(until, from + 0.01)];
  }

  advance(by) {
    if (!this.following) return super.advance(by);
    const { model } = this;
    if (this.live.lockstep) {
      if (this.time >= this.live.until) return this.live.next(); // what stands is drawn
      this.time = Math.min(this.live.until, this.time + by);
      if (this.time === this.live.until) this.live.view.say(this.time);
    } else {
      const lag = model.end - this.time;
      this.time = lag > 2 ? model.end - BEHIND : Math.min(model.end, this.time + by * Math.min(2, Math.max(0.5, lag / BEHIND)));
      const [from, to] = this.spanOf(this.time);
      if (Math.abs(from - this.from) > 0.05 || to > this.to - 0.01) this.show(from, to + (to - from) * 0.05);
    }
    this.onTime(this.time);
    if (this.live.over && !this.live.lockstep && this.time >= model.end) this.toggle(false);
  }
}

class LivePage {
  constructor({ lockstep, robotSide }) {
    Object.assign(this, { lockstep, model: new Model(), view: null, until: -Infinity, waiting: [], taking: Promise.resolve(), over: false });
    byId("live").hidden = false;
    byId("stop").hidden = robotSide;
    this.tell(robotSide ? "Waiting for the robots to say something." : "Waiting for the run to begin.");
    byId("follow").addEventListener("click", () => this.view?.player.follow());
    byId("stop").addEventListener("click", () => this.stop());
    this.source = new EventSource("told");
    this.source.addEventListener("begin", () => this.begin());
    this.source.addEventListener("part", (event) => this.heard(JSON.parse(event.data)));
    this.source.addEventListener("asked", (event) => this.ask(JSON.parse(event.data)));
    this.source.addEventListener("over", (event) => this.end(JSON.parse(event.data)));
    this.source.addEventListener("full", (event) => this.full(event.data));
    this.source.addEventListener("error", () => {
      if (!this.over) this.tell("The program that this page shows does not answer any more. This is the last state that was told; whether robots are stopped is not known.", true);
    });
  }

  tell(text, bad = false) {
    byId("live-words").textContent = text;
    byId("live").classList.toggle("bad", bad);
  }

  // Everything is told once more: after a break, or to who came late.
  begin() {
    this.taking = this.taking.then(() => {
      if (this.view) this.model.forget(-Infinity);
      this.tell(this.lockstep ? "Live, at a speed to watch: what was over last; the run itself is ahead." : "Live.");
    });
  }

  heard(part) {
    if (this.lockstep && this.view && !this.over && !document.hidden) {
      // Of each series of bouts the newest waits.
      if (this.waiting.length && sortOf(this.waiting.at(-1)) === sortOf(part)) this.waiting.pop();
      this.waiting.push(part);
      if (this.view.player.following && this.view.player.time >= this.until) this.next();
      else this.takeWords(part);
    } else this.take(part);
  }

  // The next bout, where this one has been seen.
  next(now = false) {
    if (now || this.view.player.time >= this.until) this.takeWaiting();
  }

  takeWaiting() {
    for (const part of this.waiting.splice(0)) this.take(part);
  }

  // How learning goes is shown at once, whichever bout is being looked at.
  takeWords(part) {
    const { begin, end } = this.model;
    const { since, ...rest } = part;
    this.taking = this.taking.then(async () => {
      await this.model.take({ ...rest, begin, end, terrain: null, tracks: [], traces: [], lanes: [], marks: [], chapters: [] });
      this.view.goOn();
    });
  }

  take(part) {
    this.taking = this.taking.then(() => this.put(part)).catch((error) => {
      this.tell(`This can't be shown: ${error.message}`, true);
      throw error;
    });
  }

  async put(part) {
    const { model } = this;
    await model.take(part);
    if (!this.view) {
      this.view = globalThis.hilView = new View(model, this);
      this.view.open();
    }
    const { player } = this.view;
    if (player.following) {
      player.whole = !model.chapters.length;
      if (this.lockstep) {
        const last = model.chapters.findLast((one) => one.end > part.since);
        player.time = Math.max(model.begin, part.since, last ? last.begin : -Infinity);
        this.until = Math.max(player.time, Math.min(part.end, last ? last.end : Infinity));
      } else if (!player.playing) player.time = model.end;
      player.show(...player.spanOf(player.time));
      player.run();
    }
    this.view.goOn();
    this.view.tell(player.time);
  }

  end(text) {
    this.over = true;
    this.source.close();
    this.takeWaiting();
    byId("stop").disabled = byId("asked").hidden = true;
    const died = text.includes("died");
    this.tell(text, died);
    if (died) return;
    byId("stop").hidden = byId("follow").hidden = true;
    this.taking = this.taking.then(() => this.conclude(text));
  }

  // Nothing more comes: what was learnt and how it plays stands first, and of the bouts one that shows it.
  conclude(text) {
    const { model, view } = this;
    if (!view) return;
    if (model.all) this.tell(`${text} All of it: ${model.all}`);
    view.goOn();
    byId("result").append(byId("said"), byId("lessons"));
    byId("result").hidden = !(model.said.length || model.lessons.length);
    const { player } = view;
    if (!this.lockstep || !player.following) return;
    const bouts = model.chapters.filter((one) => one.outcome);
    const tried = bouts.find((one) => one.series && one.series !== "coaching");
    const shown = bouts.findLast((one) => !tried || one.series === tried.series);
    player.toggle(false);
    player.seek(shown ? shown.end - 1e-3 : model.end);
  }

  // What the run asks of a person; no choices: nothing.
  ask({ text, choices }) {
    const known = choices.filter((choice) => CHOICES.has(choice));
    byId("asked").hidden = !known.length;
    byId("asked-words").textContent = text;
    byId("choices").replaceChildren(
      ...known.map((choice) => {
        const button = document.createElement("button");
        button.textContent = CHOICES.get(choice);
        button.addEventListener("click", () => this.answer(choice));
        return button;
      }),
    );
  }

  async answer(choice) {
    const buttons = [...byId("choices").children];
    for (const button of buttons) button.disabled = true;
    let said = null;
    try {
      said = await (await fetch(choice, { method: "POST", signal: AbortSignal.timeout(2500) })).json();
    } catch {
      said = null; // nobody answers
    }
    if (said && said.taken) return; // what is asked next puts other buttons here
    byId("asked-words").textContent += said ? " (this was answered already)" : " (nobody has heard that: once more?)";
    if (!said) for (const button of buttons) button.disabled = false;
  }

  full(most) {
    this.source.close();
    this.over = true;
    byId("stop").disabled = false;
    this.tell(`${most} pages look on already, and there is no room for one more: close one, and load this page anew. The stop works from here as well.`, true);
  }

  async stop() {
    const words = byId("stopped");
    words.hidden = false;
    words.className = "";
    words.textContent = "stop asked for …";
    let said = null;
    try {
      said = await (await fetch("stop", { method: "POST", signal: AbortSignal.timeout(2500) })).json();
    } catch {
      said = null; // nobody answers: that is not confirmed
    }
    const all = said && said.robots > 1 ? `all ${said.robots} robots say` : "the robot says";
    words.className = said && said.confirmed ? "good" : "bad";
    words.textContent = said && said.confirmed ? `stopped: ${all} so` : "NOT CONFIRMED: use the switch";
  }
}
