"""A scene as a document: numbers come back as they were told, and no text means anything to the page that it stands in."""

from __future__ import annotations

import base64
import json
import re
import tomllib
import zlib
from hashlib import sha256
from html.parser import HTMLParser
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scenes import HOSTILE, scene_of, unpacked

import hil.look
from hil.look.columns import LARGEST, Columns
from hil.look.document import LONGEST_TEXT, document_of, step_of
from hil.look.pages import LARGEST as LARGEST_PAGE
from hil.look.pages import SCRIPTS, page_of
from hil.look.scene import BodyShape, Ground, Mark, Scene, Terrain, TimeCurves, Track
from hil.look.thinning import extremes

if TYPE_CHECKING:
    from numpy.typing import NDArray

FOLDER = files(hil.look)


def taken_apart(columns: Columns) -> bytes:
    return zlib.decompress(base64.b64decode(columns.text()))


@given(
    arrays(np.float64, st.integers(0, 40), elements=st.floats(-1e6, 1e6) | st.sampled_from([np.nan, np.inf, 1e300])),
    st.sampled_from([1e-3, 1e-2, 1.0]),
)
def test_a_column_comes_back_to_within_half_a_step(values: NDArray[np.float64], step: float) -> None:
    columns = Columns()
    columns.add(np.arange(5.0), 1.0)
    place = columns.add(values, step)
    found = unpacked(taken_apart(columns), place)
    good = np.abs(values) < LARGEST * step
    assert np.isnan(found[~good]).all()
    np.testing.assert_allclose(found[good], values[good], atol=0.51 * step, rtol=0)


def test_what_changes_slowly_takes_little_room() -> None:
    columns = Columns()
    columns.add(np.arange(0.0, 1000.0, 0.05), 1e-3)
    columns.add(np.sin(np.arange(0.0, 1000.0, 0.05)), 1e-4)
    assert len(columns.text()) < 35_000  # 40,000 numbers


@pytest.mark.parametrize(
    ("values", "step"), [([7.5, 7.5], 1e-3), ([0.0, 1000.0], 0.1), ([0.0], 1.0), ([np.nan], 1.0), ([0, 4e6], 1.0)]
)
def test_curves_are_told_finely_enough(values: list[float], step: float) -> None:
    assert step_of(np.array(values)) == pytest.approx(step)


def test_times_are_told_from_the_beginning_whatever_the_log_s_clock() -> None:
    begin = 1.8e9
    trace = TimeCurves("a", "", ("b",), begin + np.arange(3.0), (np.arange(3.0),))
    scene = Scene(begin=begin, end=begin + 2.0, traces=[trace], marks=[Mark(begin + 1.5, "link", "x")])
    document = document_of(scene)
    data = zlib.decompress(base64.b64decode(document["columns"]))
    assert unpacked(data, document["traces"][0]["t"]).tolist() == [0.0, 1.0, 2.0]
    assert (document["begin"], document["end"], document["marks"]) == (0.0, 2.0, [[1.5, "link", "x"]])


def test_a_log_of_a_year_keeps_its_times() -> None:
    times = np.arange(0.0, 3.2e7, 1e5)
    document = document_of(Scene(end=times[-1], traces=[TimeCurves("a", "", ("b",), times, (times,))]))
    found = unpacked(zlib.decompress(base64.b64decode(document["columns"])), document["traces"][0]["t"])
    np.testing.assert_allclose(found, times, atol=0.1)


# --- the page --------------------------------------------------------------------------------------------------------


class Parsed(HTMLParser):
    """A page's elements, as a browser takes them apart."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.inside: dict[int, str] = {}
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.inside[len(self.tags) - 1] = self.inside.get(len(self.tags) - 1, "") + data

    def scripts(self) -> list[tuple[dict[str, str | None], str]]:
        return [(attrs, self.inside[at]) for at, (tag, attrs) in enumerate(self.tags) if tag == "script"]


EMPTY = Parsed(page_of(Scene()).decode())


def check_page(page: bytes) -> dict[str, Any]:
    """It has the elements of every page and no other; what its block of JSON holds."""
    parsed = Parsed(page.decode())
    assert parsed.tags == EMPTY.tags
    scripts = parsed.scripts()
    assert scripts[1:] == EMPTY.scripts()[1:]
    assert scripts[0][0] == {"type": "application/json", "id": "scene"}
    block = scripts[0][1]
    assert not set(block) & set("<>&\u2028\u2029")
    found: dict[str, Any] = json.loads(block)
    return found


@given(st.text(max_size=60) | st.sampled_from(HOSTILE))
def test_no_text_of_a_scene_leaves_its_block(text: str) -> None:
    document = check_page(page_of(scene_of(text)))
    assert document["title"] == text
    assert document["chapters"][0]["story"] == text
    assert document["lessons"][0]["steps"][0][0] == text
    assert document["lessons"][0]["why"] == [text]


def test_long_texts_are_cut() -> None:
    long, short = (document_of(scene_of("a" * length)) for length in (10_000, LONGEST_TEXT))
    assert long["title"] == "a" * (LONGEST_TEXT - 1) + "…"
    assert len(json.dumps(long, ensure_ascii=False)) == len(json.dumps(short, ensure_ascii=False))


def test_the_policy_allows_the_page_s_own_scripts_and_nothing_else() -> None:
    page = page_of(Scene()).decode()
    (policy,) = (attrs["content"] for _, attrs in EMPTY.tags if attrs.get("http-equiv") == "Content-Security-Policy")
    assert policy is not None
    rules = dict(rule.split(" ", 1) for rule in policy.split("; "))
    assert set(rules) == {"default-src", "script-src", "style-src", "base-uri", "form-action"}
    assert rules["default-src"] == rules["base-uri"] == rules["form-action"] == "'none'"
    _, vendor, script = re.findall(r"<script[^>]*>(.*?)</script>", page, re.DOTALL)
    (style,) = re.findall(r"<style>(.*?)</style>", page, re.DOTALL)
    for rule, texts in (("script-src", (vendor, script)), ("style-src", (style,))):
        digests = [base64.b64encode(sha256(text.encode()).digest()).decode() for text in texts]
        assert rules[rule] == " ".join(f"'sha256-{digest}'" for digest in digests)


def test_the_page_asks_for_nothing_and_makes_no_markup() -> None:
    wanted = [value for _, attrs in EMPTY.tags for name, value in attrs.items() if name in {"src", "href", "action", "srcset"}]
    assert wanted == ["#play"]
    ours = "".join(FOLDER.joinpath("page", name).read_text("utf-8") for name in SCRIPTS)
    for word in (
        "innerHTML",
        "outerHTML",
        "insertAdjacentHTML",
        "document.write",
        "eval(",
        "Function(",
        "fetch(",
        "XMLHttp",
        "import(",
    ):
        assert word not in ours, word
    assert not re.search(r"url\(|@import", FOLDER.joinpath("page", "view.css").read_text("utf-8"))


def test_somebody_else_s_code_is_as_it_was_published() -> None:
    vendor = FOLDER.joinpath("vendor")
    told = tomllib.loads(vendor.joinpath("uPlot.toml").read_text("utf-8"))
    there = {file.name for file in vendor.iterdir() if not file.name.endswith((".toml", "__pycache__"))}
    assert there == set(told["sha256"])
    for name, digest in told["sha256"].items():
        assert sha256(vendor.joinpath(name).read_bytes()).hexdigest() == digest, name
    assert "MIT" in vendor.joinpath("uPlot.LICENSE").read_text("utf-8")


# --- too much ----------------------------------------------------------------------------------------------------------


def test_extremes_and_holes_are_kept() -> None:
    rng = np.random.default_rng(1)
    times = np.arange(0.0, 1000.0, 0.02)
    first, second = rng.normal(size=(2, len(times)))
    first[7000], second[20_001], first[30_000:30_005] = 99.0, -99.0, np.nan
    kept = extremes(times, (first, second), 10.0)
    assert len(kept) < len(times) / 50
    assert {0, 7000, 20_001, len(times) - 1} <= set(kept.tolist())
    assert np.isnan(first[kept]).any()
    for begin in np.arange(0.0, 1000.0, 10.0):
        there = (times >= begin) & (times < begin + 10.0)
        for values in (first, second):
            near = values[kept][(times[kept] >= begin) & (times[kept] < begin + 10.0)]
            assert (np.nanmin(near), np.nanmax(near)) == (np.nanmin(values[there]), np.nanmax(values[there]))


def busy_scene(seconds: float) -> Scene:
    """A log of one robot that is too long, with bouts of 7.3 s."""
    rng = np.random.default_rng(2)
    times = np.arange(0.0, seconds, 0.02)
    scene = Scene(end=seconds, terrain=Terrain(Ground.RING, 0.65, 0.42))
    poses = {"t": times, **{name: rng.uniform(-0.3, 0.3, len(times)) for name in ("x", "y", "heading")}}
    scene.tracks.append(Track("junior", "Junior", "junior", BodyShape(), poses))
    noise = tuple(rng.normal(size=(2, len(times))))
    noise[0][len(times) // 3] = 1000.0
    scene.traces.append(TimeCurves("Noise", "", ("a", "b"), times, noise))
    scene.marks += [Mark(float(time), "link", "x") for time in np.arange(0.0, seconds, 11.1)]
    return scene


@pytest.mark.slow
def test_a_page_of_a_long_log_is_thinned_and_says_so() -> None:
    scene = busy_scene(20_000.0)
    events = len(scene.marks)
    scene.marks += [Mark(float(time), "decision", "y" * 100) for time in range(20_000)]
    page = page_of(scene)
    assert 1_000_000 < len(page) <= LARGEST_PAGE
    document = check_page(page)
    assert any("The log is long" in note for note in document["notes"])
    assert len(document["marks"]) == events
    assert any("but for the learner’s decisions" in note for note in document["notes"])
    values = unpacked(zlib.decompress(base64.b64decode(document["columns"])), document["traces"][0]["values"][0])
    assert np.nanmax(values) == pytest.approx(1000.0, abs=1.0)


def test_a_page_that_fits_says_nothing_of_it() -> None:
    assert check_page(page_of(busy_scene(20.0)))["notes"] == []


def test_events_without_end_do_not_make_a_page_without_end() -> None:
    scene = Scene(end=1e5, marks=[Mark(float(time), "link", "x" * 200) for time in range(50_000)])
    page = page_of(scene)
    assert len(page) <= LARGEST_PAGE
    assert any("50,000 events" in note for note in check_page(page)["notes"])
