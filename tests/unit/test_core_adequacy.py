"""How the tests of the C core are tested: which slips are made of a source, and what counts as covered."""

from __future__ import annotations

import pytest
from core_build import CORE
from core_coverage import Coverage, passes, report, share, unreachable
from core_mutants import known, mutants

SOURCE = """#define FEW 3
static int8_t few(const uint8_t *bytes, int8_t a) /* a + b */
{
    if (a >= 2 && !flag) {
        return -a;
    }
    mask = &bytes[0x10];
    mask = (uint8_t)~a;
    return (int16_t)-a * b; // a - b
}
"""


def changes(text: str) -> list[tuple[int, str]]:
    return [(mutant.line, mutant.after) for mutant in mutants("few.c", text)]


def test_operators_and_constants_are_changed_one_at_a_time() -> None:
    assert changes(SOURCE) == [
        (2, "static int8_t few(const uint8_t /bytes, int8_t a) /* a + b */"),
        (4, "if (a > 2 && !flag) {"),
        (4, "if (a <= 2 && !flag) {"),
        (4, "if (a >= 3 && !flag) {"),
        (4, "if (a >= 1 && !flag) {"),
        (4, "if (a >= 2 || !flag) {"),
        (4, "if (a >= 2 && flag) {"),
        (7, "mask = &bytes[0x11];"),
        (7, "mask = &bytes[0xf];"),
        (8, "mask = (uint8_t)a;"),
        (9, "return (int16_t)-a / b; // a - b"),
    ]


@pytest.mark.parametrize(
    ("line", "after"),
    [
        ("x = 0;", ["x = 1;"]),
        ("x = 0U;", ["x = 1U;"]),
        ("x = 0.5f;", ["x = 1.5f;"]),
        ("x += y++;", ["x -= y++;", "x += y--;"]),
        ("x = y << z;", ["x = y >> z;"]),
        ("x->y = true;", ["x->y = false;"]),
        ('s = "a + 1";', []),
        ("c = '+';", []),
        ("#define A 1 + \\\n    2", []),
        ("/* 1\n + 2 */", []),
    ],
)
def test_what_is_changed(line: str, after: list[str]) -> None:
    assert [change for _, change in changes(line)] == after


def test_a_mutant_changes_its_line_alone() -> None:
    for mutant in mutants("few.c", SOURCE):
        pairs = list(zip(SOURCE.splitlines(), mutant.text.splitlines(), strict=True))
        assert [number for number, (before, after) in enumerate(pairs, 1) if before != after] == [mutant.line]


def test_every_mutant_that_is_known_to_make_no_difference_can_still_be_made_and_has_a_reason() -> None:
    everything = {mutant.key for path in CORE for mutant in mutants(path.name, path.read_text(encoding="utf-8"))}
    reasons = known()
    assert not set(reasons) - everything
    assert all(len(reason) > 20 for reason in reasons.values())


def coverage(lines: list[int], branches: list[int]) -> Coverage:
    found = Coverage("few.c")
    for number, count in enumerate(lines, 1):
        found.add({"line_number": number, "count": count, "branches": []})
    found.branches = {(1, i): count for i, count in enumerate(branches)}
    return found


@pytest.mark.parametrize(
    ("lines", "branches", "good"),
    [([1, 2], [1] * 97 + [0] * 3, True), ([1, 2], [1] * 96 + [0] * 4, False), ([1, 0], [1] * 100, False), ([1], [], True)],
)
def test_every_line_must_run_and_97_percent_of_the_branches(lines: list[int], branches: list[int], good: bool) -> None:  # noqa: FBT001
    assert passes([coverage(lines, branches)]) is good


def test_a_line_of_several_functions_ran_when_it_ran_in_one() -> None:
    found = Coverage("few.c")
    for count in (0, 3):
        found.add({"line_number": 7, "count": count, "branches": [{"count": count}, {"count": 0}]})
    assert (found.lines, found.branches) == ({7: 3}, {(7, 0): 3, (7, 1): 0})
    assert found.missing() == ["few.c:7: branch 1 never taken"]


def test_a_line_that_says_why_it_cannot_run_is_left_out() -> None:
    text = "a;\nb; /* unreachable: it is never so */\nc; /* unreachable: */\nd; /* unreachable */\n"
    assert unreachable(text) == [2]
    found = coverage([1, 0, 1, 1], [])
    found.leave_out(unreachable(text))
    assert passes([found])


def test_what_did_not_run_is_named() -> None:
    text = report([coverage([1, 0], [1, 0])], every=True)
    assert "few.c:2: never ran" in text
    assert "few.c:1: branch 1 never taken" in text
    assert "50.0%" in text
    assert share([]) == 1.0
