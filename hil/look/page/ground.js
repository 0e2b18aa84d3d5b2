// What robots stand on, to scale, y up: drawn once, on a canvas of its own that the arena copies.

class Ground {
  constructor(model, colors) {
    Object.assign(this, { model, colors, canvas: document.createElement("canvas") });
  }

  // How large it is drawn in so many CSS pixels, and with how many device pixels each.
  layOut(width, ratio) {
    const place = this.model.terrain;
    const margin = place.ground === "ring" ? 0.1 : place.ground === "table" ? 0.06 * place.width : 0;
    const across = place.width + 2 * margin;
    const up = place.height + 2 * margin;
    const most = Math.max(220, Math.min(window.innerHeight * 0.62, 720));
    const foot = place.ground === "table" ? 26 : 0; // for the scale, where there is no margin to speak of
    this.width = width;
    this.scale = Math.min(width / across, (most - foot) / up);
    this.height = Math.round(up * this.scale) + foot;
    this.middle = [width / 2, (this.height - foot) / 2];
    this.ratio = ratio;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(this.height * ratio);
    this.draw();
  }

  at(x, y) {
    return [this.middle[0] + x * this.scale, this.middle[1] - y * this.scale];
  }

  draw() {
    const context = this.canvas.getContext("2d", { alpha: false });
    const { terrain: place } = this.model;
    const color = this.colors;
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.fillStyle = color("--beyond");
    context.fillRect(0, 0, this.width + 1, this.height + 1);
    if (place.ground === "none") {
      context.fillStyle = color("--soft");
      context.font = "13px " + color("--font");
      context.textAlign = "center";
      context.fillText("Where it is, nobody has measured: it is drawn in its own frame, its nose up.", this.width / 2, 20, this.width - 20);
      return;
    }
    const [left, top] = this.at(-place.width / 2, place.height / 2);
    const wide = place.width * this.scale;
    const high = place.height * this.scale;
    context.fillStyle = color("--ground");
    context.fillRect(left, top, wide, high);
    const grid = gridStep(60 / this.scale);
    context.strokeStyle = color("--grid");
    context.lineWidth = 1;
    context.beginPath();
    for (let x = Math.ceil(-place.width / 2 / grid) * grid; x <= place.width / 2; x += grid) {
      const [at] = this.at(x, 0);
      context.moveTo(Math.round(at) + 0.5, top);
      context.lineTo(Math.round(at) + 0.5, top + high);
    }
    for (let y = Math.ceil(-place.height / 2 / grid) * grid; y <= place.height / 2; y += grid) {
      const [, at] = this.at(0, y);
      context.moveTo(left, Math.round(at) + 0.5);
      context.lineTo(left + wide, Math.round(at) + 0.5);
    }
    context.stroke();
    this.drawObstacles(context, place.obstacles);
    context.strokeStyle = color("--edge");
    context.lineWidth = place.ground === "ring" ? 4 : place.wall ? 4 : 1.5;
    context.setLineDash(place.ground === "table" && !place.wall ? [6, 5] : []);
    context.strokeRect(left, top, wide, high);
    context.setLineDash([]);
    this.drawScale(context, grid);
  }

  // What stands in the way; an outline within another is a hole in it.
  drawObstacles(context, outlines) {
    context.beginPath();
    for (const outline of outlines) {
      outline.forEach(([x, y], corner) => (corner ? context.lineTo(...this.at(x, y)) : context.moveTo(...this.at(x, y))));
      context.closePath();
    }
    context.fillStyle = this.colors("--obstacle");
    context.fill("evenodd");
  }

  drawScale(context, grid) {
    const color = this.colors;
    const long = grid * this.scale;
    const [x, y] = [12, this.height - 12];
    context.strokeStyle = context.fillStyle = color("--ink");
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(x, y - 4);
    context.lineTo(x, y);
    context.lineTo(x + long, y);
    context.lineTo(x + long, y - 4);
    context.stroke();
    context.font = "12px " + color("--font");
    context.textAlign = "left";
    context.textBaseline = "alphabetic";
    const text = grid >= 1 ? grid + " m" : Math.round(grid * 100) + " cm";
    context.lineWidth = 3;
    context.strokeStyle = color("--beyond");
    context.strokeText(text, x + long + 6, y);
    context.fillText(text, x + long + 6, y);
  }
}

// A round length, in m, of at least so many.
function gridStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= least * 0.999);
}
