"""How long a frame of a view takes while it plays: so many robots with 16 rays each, drawn by software in headless Chromium.

    PYTHONPATH=tests/support python benchmarks/view_frames.py [--robots 33 1000]

A page is played for some seconds, and the time from frame to frame is taken where the browser tells it. A browser draws no
more than 60 frames a second: a median of 16.7 ms is as good as can be. `drawing` is what a frame costs the page's script, and
`to its pixels` the same until a pixel of the canvas can be read back, which waits for all that was drawn.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from pathlib import Path

import numpy as np
from chromium import Chromium

from hil.look.pages import page_of
from hil.look.scene import BodyShape, Ground, Scene, Terrain, Track

RAYS = 16
LENGTH = 30.0
MEASURE = """async (wanted) => {
  const view = globalThis.hilView, drawn = [], tell = view.player.onTime;
  view.player.onTime = (time) => { const at = performance.now(); tell(time); drawn.push(performance.now() - at); };
  view.player.toggle(true);
  const times = [], whole = [];
  await new Promise((done) => {
    const next = (now) => { times.push(now); if (times.length > wanted) done(); else requestAnimationFrame(next); };
    requestAnimationFrame(next);
  });
  view.player.toggle(false);
  for (let frame = 0; frame < 60; frame++) {
    const at = performance.now();
    tell(view.model.begin + frame / 10);
    view.arena.context.getImageData(0, 0, 1, 1);
    whole.push(performance.now() - at);
    await new Promise((done) => requestAnimationFrame(done));
  }
  return [times.slice(1).map((time, at) => time - times[at]), drawn, whole];
}"""


def crowd(robots: int, seed: int = 1) -> Scene:
    """A swarm that wanders about a table, told twice a second, each robot with its rays.

    Args:
        robots: How many.
        seed: Of their ways.
    """
    rng = np.random.default_rng(seed)
    side = 0.35 * math.sqrt(robots)
    times = np.arange(0.0, LENGTH, 0.5)
    scene = Scene(title=f"{robots} robots", end=LENGTH, terrain=Terrain(Ground.TABLE, side, side))
    for number in range(robots):
        heading = np.cumsum(rng.normal(0.0, 0.4, len(times)))
        start = rng.uniform(-side / 2, side / 2, 2)
        x, y = (start[axis] + np.cumsum(0.02 * way(heading)) for axis, way in enumerate((np.cos, np.sin)))
        poses = {"t": times, "x": x, "y": y, "heading": np.remainder(heading + np.pi, 2 * np.pi) - np.pi}
        poses["flags"] = (rng.random(len(times)) < 0.1) * 2.0
        rays = {f"r{ray}": rng.uniform(0.03, 0.3, len(times)) for ray in range(RAYS)}
        rays |= {"t": times, "hits": rng.integers(0, 1 << RAYS, len(times)).astype(np.float64)}
        kind = "ranger" if number % 4 else "wild"
        scene.tracks.append(Track(str(number), f"{kind.upper()} {number}", kind, BodyShape(radius=0.02), poses, {}, rays))
    return scene


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--robots", type=int, nargs="+", default=[2, 33, 200, 1000])
    options = parser.parse_args()
    print("| robots | page | frame, median | 95 % | drawing, median | to its pixels, median |")
    print("|---:|---:|---:|---:|---:|---:|")
    with tempfile.TemporaryDirectory() as folder, Chromium() as browser:
        for robots in options.robots:
            path = Path(folder, f"{robots}.html")
            path.write_bytes(page_of(crowd(robots)))
            page = browser.page(width=1280, height=800)
            page.open(path, "globalThis.hilView")
            frames, drawn, whole = page.ask(f"({MEASURE})({options.frames})")
            page.close()
            apart = np.array(frames[10:])
            size = path.stat().st_size / 1e6
            print(
                f"| {robots} | {size:.2f} MB | {np.median(apart):.1f} ms | {np.percentile(apart, 95):.1f} ms "
                f"| {np.median(drawn):.1f} ms | {np.median(whole):.1f} ms |"
            )


if __name__ == "__main__":
    main()
