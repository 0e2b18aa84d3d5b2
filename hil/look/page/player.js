// The player: what time it is, what part of the run is shown, and the keys.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];
const FRAME = 0.05;

class Player {
  constructor(model, onTime, onWindow) {
    Object.assign(this, { model, onTime, onWindow, playing: false, speed: 1, whole: false, zoomed: false });
    this.still = matchMedia("(prefers-reduced-motion: reduce)");
    this.last = 0;
    this.begin();
  }

  begin() {
    const first = this.model.chapters[0];
    this.whole = !first;
    this.time = first ? first.begin : this.model.begin;
    [this.from, this.to] = this.spanOf(this.time);
  }

  spanOf(time) {
    const { model } = this;
    const chapter = model.chapters[Math.max(0, model.chapterAt(time))];
    if (this.whole || !chapter) return [model.begin, Math.max(model.end, model.begin + 0.01)];
    return [chapter.begin, Math.max(chapter.end, chapter.begin + 0.01)];
  }

  seek(time, { stay = false } = {}) {
    const { model } = this;
    this.time = Math.min(model.end, Math.max(model.begin, time));
    if (!stay && (this.time < this.from - 1e-6 || this.time > this.to + 1e-6)) {
      this.zoomed = false;
      const [from, to] = this.spanOf(this.time);
      // Between two bouts the one before is shown, with what follows it.
      this.show(Math.min(from, this.time), Math.max(to, this.time));
    }
    this.onTime(this.time);
  }

  // Only a part of what would be shown, which a person has marked.
  closer(from, to) {
    this.zoomed = true;
    this.show(from, to);
    if (this.time < from || this.time > to) this.seek(from);
    else this.onTime(this.time);
  }

  show(from, to) {
    [this.from, this.to] = [from, to];
    this.onWindow(from, to);
  }

  setWhole(whole) {
    this.whole = whole;
    this.zoomed = false;
    this.show(...this.spanOf(this.time));
    this.onTime(this.time);
  }

  chapter(index) {
    const { chapters } = this.model;
    if (!chapters.length) return this.seek(index <= 0 ? this.model.begin : this.model.end);
    const chapter = chapters[Math.min(chapters.length - 1, Math.max(0, index))];
    this.time = chapter.begin;
    this.zoomed = false;
    if (!this.whole) this.show(...this.spanOf(chapter.begin));
    this.onTime(this.time);
  }

  chapterBefore() {
    const at = this.model.chapterAt(this.time);
    const chapter = this.model.chapters[at];
    this.chapter(chapter && this.time > chapter.begin + 0.5 ? at : at - 1);
  }

  chapterOn() {
    this.chapter(this.model.chapterAt(this.time) + 1);
  }

  mark(direction, marks) {
    const ahead = direction > 0 ? marks.find((mark) => mark.time > this.time + 1e-3) : [...marks].reverse().find((mark) => mark.time < this.time - 1e-3);
    if (ahead) this.seek(ahead.time);
  }

  toggle(playing = !this.playing) {
    if (playing === this.playing) return;
    if (playing && this.time >= this.model.end - 1e-6) this.seek(this.model.begin);
    this.playing = playing;
    this.last = 0;
    if (playing) requestAnimationFrame((now) => this.frame(now));
    this.onTime(this.time);
  }

  frame(now) {
    if (!this.playing) return;
    const apart = this.last ? Math.min(0.25, (now - this.last) / 1000) : 0;
    if (!this.still.matches || apart >= 0.24 || !this.last) {
      this.last = now;
      this.advance(apart * this.speed);
    }
    if (this.playing) requestAnimationFrame((next) => this.frame(next));
  }

  advance(by) {
    const { model } = this;
    const time = this.time + by;
    if (time >= model.end) {
      this.time = model.end;
      this.playing = false;
    } else {
      this.time = time;
      if (time > this.to && this.zoomed) this.show(this.to, Math.min(model.end, 2 * this.to - this.from));
      else if (time > this.to) {
        const next = model.chapterAt(time);
        if (!this.whole && next >= 0 && model.chapters[next].begin >= this.to - 1e-6) this.show(...this.spanOf(time));
        else if (time > this.to + 2 || this.whole) this.show(...this.spanOf(time));
      }
    }
    this.onTime(this.time);
  }

  faster(direction) {
    const at = SPEEDS.indexOf(this.speed);
    this.speed = SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, at + direction))];
  }
}
