// The arena on a canvas: its ground, and on it the bodies with what they sense.

const KINDS = {
  junior: { color: "--junior", mark: "J" },
  opponent: { color: "--opponent", mark: "O" },
  ranger: { color: "--junior", mark: "R" },
  wild: { color: "--opponent", mark: "W" },
  robot: { color: "--robot", mark: "" },
  box: { color: "--box", mark: "" },
  goal: { color: "--goal", mark: "" },
};
const STALE = 5; // seconds without a word of a robot, from which on it is drawn pale
const CONTACTS = 3; // bits of an observation's flags: contact ahead, contact

class Arena {
  constructor(canvas, model, colors) {
    this.canvas = canvas;
    this.model = model;
    this.colors = colors;
    this.context = canvas.getContext("2d", { alpha: false });
    this.ground = new Ground(model, colors);
    this.picked = null;
    this.poses = [];
    this.groups = [];
    this.arrange();
  }

  // Tracks by kind: each kind is one path, however many robots it has.
  arrange() {
    const order = Object.keys(KINDS);
    const groups = new Map();
    for (const track of this.model.tracks.values()) {
      const kind = own(KINDS, track.kind) ? track.kind : "robot";
      if (!groups.has(kind)) groups.set(kind, []);
      groups.get(kind).push({ track, pose: { x: 0, y: 0, heading: 0, row: 0, age: 0 }, there: false });
    }
    this.groups = [...groups.entries()].sort((a, b) => order.indexOf(b[0]) - order.indexOf(a[0]));
    this.bodies = this.groups.flatMap(([, bodies]) => bodies);
    this.many = this.bodies.length > 12;
  }

  resize() {
    const { width } = this.canvas.parentElement.getBoundingClientRect();
    if (!this.model.terrain || !width) return;
    this.ground.layOut(width, Math.min(window.devicePixelRatio || 1, this.many ? 1.5 : 2));
    ({ width: this.width, height: this.height, scale: this.scale, ratio: this.ratio } = this.ground);
    this.canvas.style.height = this.height + "px";
    this.canvas.width = this.ground.canvas.width;
    this.canvas.height = this.ground.canvas.height;
  }

  at(x, y) {
    return this.ground.at(x, y);
  }

  draw(time) {
    const { context, model } = this;
    if (!model.terrain || !this.width) return;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this.ground.canvas, 0, 0);
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    for (const body of this.bodies) {
      body.there = poseAt(body.track, time, body.pose);
      if (model.terrain.ground === "none") body.pose.heading = Math.PI / 2;
    }
    this.drawTrails(time);
    this.drawRays(time);
    for (const body of this.bodies) if (body.there && body.track.shape.beams.length) this.drawBeams(body, time);
    for (const [kind, bodies] of this.groups) {
      if (kind === "junior" || kind === "opponent" || kind === "box" || kind === "goal") {
        for (const body of bodies) this.drawBody(body, kind, time);
      } else this.drawCrowd(bodies, kind);
    }
    this.drawContacts();
    this.drawPicked();
    this.drawVerdict(time);
  }

  // What is over, and a robot that is stopped, said in large letters.
  drawVerdict(time) {
    const { context, model } = this;
    const chapter = model.chapters[model.chapterAt(time)];
    const lane = model.lanes.get("State");
    const at = lane ? model.stretchAt(lane, time) : -1;
    let [text, color] = ["", "--bad"];
    if (at >= 0 && lane.words[lane.code[at]] === "stopped") text = "■ stopped by the e-stop";
    else if (chapter && own(OUTCOMES, chapter.outcome) && time >= chapter.end - 0.02) {
      text = `${OUTCOMES[chapter.outcome].sign} ${chapter.outcome}`;
      color = OUTCOMES[chapter.outcome].color;
    }
    if (!text) return;
    context.font = "700 20px " + this.colors("--font");
    context.textAlign = "center";
    context.textBaseline = "middle";
    const wide = context.measureText(text).width + 28;
    context.fillStyle = this.colors(color);
    context.fillRect(this.width / 2 - wide / 2, 10, wide, 34);
    context.fillStyle = this.colors("--on-tone");
    context.fillText(text, this.width / 2, 28);
  }

  drawTrails(time) {
    const { context, model } = this;
    const chapter = model.chapters[model.chapterAt(time)];
    const trails = this.many ? this.bodies.filter((body) => body.track.key === this.picked) : this.bodies;
    for (const { track, there } of trails) {
      if (!there || model.terrain.ground === "none") continue;
      const { t, x, y, gap } = track.poses;
      const last = rowAt(t, time);
      const since = Math.max(0, rowAt(t, chapter ? chapter.begin - 0.02 : time - 10) + 1);
      context.strokeStyle = this.colors(own(KINDS, track.kind)?.color || "--robot");
      context.globalAlpha = 0.45;
      context.lineWidth = 1.5;
      context.setLineDash(track.kind === "opponent" || track.kind === "wild" ? [4, 3] : []);
      context.beginPath();
      for (let row = since; row <= last; row++) {
        const [px, py] = this.at(x[row], y[row]);
        if (row === since || (gap && gap[row] > 0)) context.moveTo(px, py);
        else context.lineTo(px, py);
      }
      context.stroke();
      context.setLineDash([]);
      context.globalAlpha = 1;
    }
  }

  // Ranges round about, of all robots in two paths: those that hit something, and those that hit a robot.
  drawRays(time) {
    const { context, scale } = this;
    const [midX, midY] = this.ground.middle;
    const [hit, robot] = [new Path2D(), new Path2D()];
    let any = false;
    for (const { track, pose, there } of this.bodies) {
      if (!there || !track.fan.length) continue;
      const row = rowAt(track.rays.t, time);
      if (row < 0) continue;
      any = true;
      const count = track.fan.length;
      const [x, y] = [midX + pose.x * scale, midY - pose.y * scale];
      const hits = track.rays.hits[row];
      const start = track.shape.radius;
      for (let ray = 0; ray < count; ray++) {
        const range = track.fan[ray][row];
        if (!(range > start)) continue;
        const angle = pose.heading + (ray * 2 * Math.PI) / count;
        const [along, up] = [Math.cos(angle) * scale, -Math.sin(angle) * scale];
        const path = hits & (1 << ray) ? robot : hit;
        path.moveTo(x + along * start, y + up * start);
        path.lineTo(x + along * range, y + up * range);
      }
    }
    if (!any) return;
    context.lineWidth = 1;
    context.strokeStyle = this.colors("--ray");
    context.stroke(hit);
    context.strokeStyle = this.colors("--ray-robot");
    context.stroke(robot);
  }

  drawCrowd(bodies, kind) {
    const { context, scale } = this;
    const [midX, midY] = this.ground.middle;
    const fresh = new Path2D();
    const stale = new Path2D();
    const noses = new Path2D();
    for (const { track, pose, there } of bodies) {
      if (!there) continue;
      const radius = Math.max(track.shape.radius * scale, 2.5);
      const [x, y] = [midX + pose.x * scale, midY - pose.y * scale];
      const path = pose.age > STALE ? stale : fresh;
      if (kind === "wild") path.rect(x - 0.9 * radius, y - 0.9 * radius, 1.8 * radius, 1.8 * radius);
      else {
        path.moveTo(x + radius, y);
        path.arc(x, y, radius, 0, 2 * Math.PI);
      }
      noses.moveTo(x, y);
      noses.lineTo(x + Math.cos(pose.heading) * radius * 1.4, y - Math.sin(pose.heading) * radius * 1.4);
    }
    context.fillStyle = this.colors(KINDS[kind].color);
    context.fill(fresh);
    context.globalAlpha = 0.35;
    context.fill(stale);
    context.globalAlpha = 1;
    context.strokeStyle = this.colors("--nose");
    context.lineWidth = 1.5;
    context.stroke(noses);
    if (bodies.length && 2 * bodies[0].track.shape.radius * scale > 24) this.nameCrowd(bodies);
  }

  nameCrowd(bodies) {
    const { context } = this;
    context.fillStyle = this.colors("--ink");
    context.font = "11px " + this.colors("--font");
    context.textAlign = "left";
    for (const { track, pose, there } of bodies) {
      if (!there) continue;
      const [x, y] = this.at(pose.x, pose.y);
      context.fillText(track.key, x + track.shape.radius * this.scale, y - track.shape.radius * this.scale);
    }
  }

  // From here on, the robot's own frame is drawn in, in m.
  enter(pose) {
    const { context, scale } = this;
    context.save();
    context.translate(...this.at(pose.x, pose.y));
    context.rotate(-pose.heading);
    context.scale(scale, -scale);
  }

  drawBeams({ track, pose }, time) {
    const { context, scale } = this;
    const flags = flagsAt(track, time, pose);
    this.enter(pose);
    for (const [x, y, angle, half, reach, bit] of track.shape.beams) {
      const lit = (flags & bit) !== 0;
      context.beginPath();
      context.moveTo(x, y);
      context.arc(x, y, reach, angle - half, angle + half);
      context.closePath();
      context.fillStyle = this.colors(lit ? "--beam-lit" : "--beam");
      context.fill();
      if (lit) {
        context.strokeStyle = this.colors("--beam-edge");
        context.lineWidth = 1.5 / scale;
        context.stroke();
      }
    }
    context.restore();
  }

  drawBody({ track, pose, there }, kind, time) {
    if (!there) return;
    const { context, scale } = this;
    const { shape } = track;
    const flags = flagsAt(track, time, pose);
    this.enter(pose);
    context.beginPath();
    if (shape.outline.length) shape.outline.forEach(([x, y], corner) => (corner ? context.lineTo(x, y) : context.moveTo(x, y)));
    else context.arc(0, 0, shape.radius, 0, 2 * Math.PI);
    context.closePath();
    context.fillStyle = this.colors(KINDS[kind].color);
    context.globalAlpha = kind === "goal" ? 0.3 : 0.92;
    context.fill();
    context.globalAlpha = 1;
    if (kind === "junior") {
      context.beginPath(); // a nose: which way it looks
      context.moveTo(0.05, 0);
      context.lineTo(0.03, 0.014);
      context.lineTo(0.03, -0.014);
      context.closePath();
      context.fillStyle = this.colors("--nose");
      context.fill();
    }
    for (const [, points, bit] of shape.spots) this.drawSpot(points, (flags & bit) !== 0);
    context.restore();
    if (KINDS[kind].mark) {
      const [x, y] = this.at(pose.x, pose.y);
      context.fillStyle = this.colors("--nose");
      context.font = `600 ${Math.max(11, Math.min(18, 0.05 * scale))}px ` + this.colors("--font");
      context.textAlign = "center";
      context.textBaseline = "middle";
      context.fillText(KINDS[kind].mark, x, y);
    }
  }

  drawSpot(points, lit) {
    const { context, scale } = this;
    if (points.length > 1) {
      context.beginPath();
      context.moveTo(...points[0]);
      context.lineTo(...points[1]);
      context.strokeStyle = this.colors(lit ? "--touch" : "--nose");
      context.lineWidth = (lit ? 6 : 2) / scale;
      context.stroke();
    } else if (lit) {
      context.beginPath();
      context.arc(...points[0], 5 / scale, 0, 2 * Math.PI);
      context.fillStyle = this.colors("--touch");
      context.fill();
    }
  }

  drawContacts() {
    const { context } = this;
    const path = new Path2D();
    let any = false;
    for (const { track, pose, there } of this.bodies) {
      if (!there || !track.poses.flags || !(track.poses.flags[pose.row] & CONTACTS)) continue;
      any = true;
      const [x, y] = this.at(pose.x, pose.y);
      const radius = Math.max(track.shape.radius * this.scale, 2.5) + 2;
      path.moveTo(x + radius, y);
      path.arc(x, y, radius, 0, 2 * Math.PI);
    }
    if (!any) return;
    context.strokeStyle = this.colors("--touch");
    context.lineWidth = 1.5;
    context.stroke(path);
  }

  // The robot that is picked out: how far it senses, and in which sectors it senses whom.
  drawPicked() {
    const body = this.bodies.find((one) => one.track.key === this.picked);
    if (!body || !body.there || !this.many) return;
    const { context, scale } = this;
    const { track, pose } = body;
    const [x, y] = this.at(pose.x, pose.y);
    const sensed = track.poses.radius ? track.poses.radius[pose.row] : NaN;
    if (sensed > 0) {
      const { sectors } = track.shape;
      for (const [name, color, inner] of [["near0", "--junior", 0.82], ["near1", "--opponent", 0.66]]) {
        const mask = track.poses[name] ? track.poses[name][pose.row] : 0;
        for (let sector = 0; sector < sectors; sector++) {
          if (!(mask & (1 << (sectors - 1 - sector)))) continue;
          const from = -pose.heading - (sector * 2 * Math.PI) / sectors;
          context.beginPath();
          context.arc(x, y, sensed * scale * inner, from, from - (2 * Math.PI) / sectors, true);
          context.lineTo(x, y);
          context.closePath();
          context.fillStyle = this.colors(color);
          context.globalAlpha = 0.18;
          context.fill();
          context.globalAlpha = 1;
        }
      }
      context.strokeStyle = this.colors("--ink");
      context.lineWidth = 1;
      context.setLineDash([3, 3]);
      context.beginPath();
      context.arc(x, y, sensed * scale, 0, 2 * Math.PI);
      context.stroke();
      context.setLineDash([]);
    }
    context.strokeStyle = this.colors("--ink");
    context.lineWidth = 2.5;
    context.beginPath();
    context.arc(x, y, Math.max(track.shape.radius * scale, 3) + 4, 0, 2 * Math.PI);
    context.stroke();
  }

  // The robot nearest to a place on the canvas, in CSS pixels; null where none is near.
  nearest(px, py) {
    let [best, found] = [20 * 20, null];
    for (const { track, pose, there } of this.bodies) {
      if (!there) continue;
      const [x, y] = this.at(pose.x, pose.y);
      const far = (x - px) ** 2 + (y - py) ** 2;
      if (far < best) [best, found] = [far, track.key];
    }
    return found;
  }
}
