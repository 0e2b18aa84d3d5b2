"""What a log holds besides the robot's own messages: one dataclass per kind of entry.

Each becomes a protobuf message of the same field names (see `schemas`); the text in an annotation is the field's comment.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Final

EVENTS: Final = "/events"
"""Topic of what is worth telling a person."""
SERIES: Final = "series"
"""Kind of the event that begins what belongs together."""


@dataclass(frozen=True)
class WireBytes:
    """Bytes that went over a link, as they came from or went to it."""

    direction: Annotated[str, "rx: robot to host, tx: host to robot"]
    link: Annotated[str, "address of the link"]
    data: Annotated[bytes, "the bytes"]


@dataclass(frozen=True)
class RejectedInput:
    """Bytes from the wire that were not accepted as a message."""

    reason: Annotated[str, "why"]
    detail: Annotated[str, "more, where there is more to say"]
    data: Annotated[bytes, "the bytes"]


@dataclass(frozen=True)
class BridgeStep:
    """One step of the bridge: all that its decisions depend on, so that a run can be replayed decision for decision."""

    clock: Annotated[float, "s; the one reading of the clock in this step"]
    chunk_times: Annotated[tuple[float, ...], "s; when each chunk consumed in this step had arrived"]
    chunk_sizes: Annotated[tuple[int, ...], "bytes of each chunk"]
    inputs: Annotated[tuple[str, ...], "what was asked for since the step before: interrupt, suspend, continue, key X"] = ()
    input_robots: Annotated[tuple[str, ...], "of each input, for which robot it was, as far as it was for one"] = ()
    network: Annotated[str, "name of the network whose step this is: the address of its link"] = ""
    lost: Annotated[str, "why the link is gone, and is going to be opened again; empty where it is not"] = ""
    lost_link: Annotated[str, "address of the link that is gone"] = ""
    ended: Annotated[str, "why the link is gone for good; empty where it is not"] = ""
    ended_link: Annotated[str, "address of the link that is gone for good"] = ""
    back: Annotated[str, "address under which the link is there again; empty where it is not"] = ""
    news: Annotated[tuple[str, ...], "what has happened to the link, in its own words"] = ()
    dropped: Annotated[int, "bytes that came and were given up since the step before, since too many waited"] = 0


@dataclass(frozen=True)
class BridgeOpening:
    """How a bridge begins: what its first step starts from."""

    network: Annotated[str, "name of the network: the address of its link as it was asked for"]
    link: Annotated[str, "address of the link, as it calls itself"]
    wire: Annotated[str, "what it carries: mavlink or can"]
    lockstep: Annotated[bool, "time passes only while the host waits"]
    clock: Annotated[float, "s; the first reading of the clock"]
    signing_time: Annotated[int, "10 us since 2015-01-01 GMT; the calendar at that moment; 0: nothing is signed"]


@dataclass(frozen=True)
class SessionDrawn:
    """A number was drawn by chance: the first of a network is the host's own, the others are of sessions."""

    network: Annotated[str, "name of the network"]
    number: Annotated[int, "the number, 1..65535"]


@dataclass(frozen=True)
class UnsentBytes:
    """Bytes that the link did not take."""

    link: Annotated[str, "address of the link"]
    data: Annotated[bytes, "the bytes"]
    timeout: Annotated[bool, "it did not take them in time, and is still there; else it is gone"]
    error: Annotated[str, "why"]


@dataclass(frozen=True)
class EventRecord:
    """Something worth telling a person: link, safety, bout."""

    kind: Annotated[str, "link, safety, bout, ..."]
    text: Annotated[str, "what happened, in words"]
    fields: Annotated[str, "JSON object of the particulars"]


@dataclass(frozen=True)
class DecisionRecord:
    """What the learner asked for, and why; written before the maneuver is performed."""

    trial: Annotated[int, "number of the trial, from 1"]
    phase: Annotated[int, "1 basic actions, 2 fine actions"]
    exam: Annotated[bool, "one of the last tests of the best"]
    generation: Annotated[int, "steps of the genetic programming made before in this category and phase"]
    tried: Annotated[int, "how often the maneuver was performed before in this category"]
    previous: Annotated[str, "previous stimulus of the category, or any"]
    current: Annotated[str, "current stimulus of the category, as `left`"]
    actions: Annotated[str, "names of the actions"]
    motive: Annotated[
        str, "why: untried, more evidence, best known, again in this bout, exam of the promising, generation done"
    ]
    origin: Annotated[str, "how it arose: random, refinement, crossover, mutation, crossover and mutation, not known"]
    parents: Annotated[tuple[str, ...], "names of the actions of each maneuver it descends from"]
    digest: Annotated[str, "of all decisions up to this one, 16 hexadecimal digits"]
    expected: Annotated[float | None, "fitness that the model expects of the maneuver"] = None
    error: Annotated[float | None, "standard error of that"] = None
    mirrored: Annotated[bool, "the mirror image of what is known of the mirror image of the category"] = False

    ADDED: ClassVar = frozenset(("expected", "error", "mirrored"))


@dataclass(frozen=True)
class CreditRecord:
    """What the learner credited to which trials when it was told how one went."""

    trial: Annotated[int, "number of the trial told of; 0 where a bout was interrupted"]
    telling: Annotated[str, "performed, discarded, bout interrupted"]
    trials: Annotated[tuple[int, ...], "trials credited, oldest first; after a bout won each a second time, for that"]
    credits: Annotated[tuple[float, ...], "what each of these was credited with"]
    rated: Annotated[tuple[int, ...], "trials whose fitness is final now"]
    fitness: Annotated[tuple[float, ...], "the final fitness of each of these"]
    digest: Annotated[str, "of all decisions up to this one, 16 hexadecimal digits"]


@dataclass(frozen=True)
class CheckpointRecord:
    """The learner's whole state when a checkpoint was due, as a digest."""

    used: Annotated[int, "maneuvers performed by then"]
    digest: Annotated[str, "of the whole state, 16 hexadecimal digits"]


@dataclass(frozen=True)
class TrialRecord:
    """One maneuver performed for the learner, and what it was worth."""

    id: Annotated[int, "number of the trial, from 1"]
    previous: Annotated[str, "previous stimulus of the category, or any"]
    current: Annotated[str, "current stimulus of the category, as `left`"]
    phase: Annotated[int, "1 basic actions, 2 fine actions"]
    exam: Annotated[bool, "one of the last tests of the best"]
    actions: Annotated[str, "names of the actions"]
    period: Annotated[float, "s; time an action lasts"]
    fitness: Annotated[float, "what this performance was worth"]
    performed: Annotated[int, "actions begun"]
    won: Annotated[bool, "the bout was won during the maneuver"]
    lost: Annotated[bool, "the bout was lost during the maneuver"]
    progress: Annotated[float | None, "m; how much nearer the opponent came to the border"]
    duration: Annotated[float, "s; from the command until its result came"]
    ended: Annotated[str, "how the maneuver ended, as `floor reflex`"]


@dataclass(frozen=True)
class StepRecord:
    """A step of the genetic programming of one category: a point of its fitness curve."""

    previous: Annotated[str, "previous stimulus of the category, or any"]
    current: Annotated[str, "current stimulus of the category, as `left`"]
    phase: Annotated[int, "1 basic actions, 2 fine actions"]
    generation: Annotated[int, "number of the generation that has just been rated, from 0 in each phase"]
    used: Annotated[int, "maneuvers performed by then, all categories together"]
    evaluations: Annotated[int, "maneuvers performed by then in this category and phase"]
    best: Annotated[float, "highest mean fitness in the generation"]
    mean: Annotated[float, "mean fitness of the generation"]
    actions: Annotated[str, "names of the actions of the best"]


@dataclass(frozen=True)
class AdviceRecord:
    """Advice as it stood, as JSON."""

    json: Annotated[str, "the advice file's content"]


@dataclass(frozen=True)
class SwarmRoundRecord:
    """A round: robots of a swarm were asked, or moved, all at once. What each said is an entry of its own."""

    step: Annotated[int, "step of the mission, from 0; -1: none"]
    order: Annotated[str, "what it was for, as `observe rangers` or `move wilds`"]
    asked: Annotated[tuple[str, ...], "robots that took part: NETWORK.ID, or ID where there is one network"]
    missing: Annotated[tuple[str, ...], "those that did not answer in time"]
    refused: Annotated[tuple[str, ...], "those that refused"]
    reasons: Annotated[tuple[str, ...], "why each did"]
    seconds: Annotated[float, "s; how long the round took"]


@dataclass(frozen=True)
class SurroundStateRecord:
    """How the surround task stands after a step; lengths are in the book's units."""

    seed: Annotated[int, "seed of the run"]
    step: Annotated[int, "number of the step; 0 is the start"]
    steps: Annotated[int, "how many there are to be"]
    distance: Annotated[float | None, "mean distance from a RANGER to the nearest WILD"]
    ranger_distance: Annotated[float | None, "mean distance between two RANGERs"]
    share_surrounded: Annotated[float | None, "share of WILDs with three RANGERs or more within R0"]
    outside: Annotated[float | None, "share of RANGERs outside the area"]
    ranger_stimuli: Annotated[tuple[int, ...], "how many RANGERs met each stimulus, STIMULUS1 first"]
    ranger_behaviours: Annotated[tuple[int, ...], "how many RANGERs performed each behaviour, B1 first"]
    wild_stimuli: Annotated[tuple[int, ...], "how many WILDs met each stimulus"]
    wild_behaviours: Annotated[tuple[int, ...], "how many WILDs performed each behaviour"]
    tables: Annotated[str, "what has been learnt, as JSON, every ten steps and at the end; else empty"]
    digest: Annotated[str, "of the adviser's whole state, 16 hexadecimal digits, as often; else empty"]
    case: Annotated[str, "the case that is played, by the book's name"] = ""
    area: Annotated[tuple[float, ...], "sides of the area, about the origin"] = ()
    body: Annotated[float, "radius of a robot"] = 0.0
    ranger_positions: Annotated[tuple[float, ...], "x, y of each RANGER as it said last, in turn; NaN: it never has"] = ()
    wild_positions: Annotated[tuple[float, ...], "x, y of each WILD, likewise"] = ()
    measures: Annotated[str, "what is told of the run so far, as JSON, as often; else empty"] = ""

    ADDED: ClassVar = frozenset(("case", "area", "body", "ranger_positions", "wild_positions", "measures"))
    """Logs of before they were added are read without them."""


@dataclass(frozen=True)
class SurroundEvaluationRecord:
    """What came of a run that a search among conditions has asked for."""

    search_seed: Annotated[int, "seed of the search"]
    number: Annotated[int, "number of the evaluation in its search, from 1"]
    generation: Annotated[int, "number of the generation, from 1; 0: none, as of conditions that are run again for their means"]
    case: Annotated[str, "the conditions, by the book's name"]
    seed: Annotated[int, "seed of the run"]
    contact: Annotated[float | None, "fitness CONTACT (Eq. 9.3)"]
    surround: Annotated[float | None, "fitness SURROUND (Eq. 9.5)"]
    chase: Annotated[float | None, "fitness CHASE (Eq. 9.7)"]
    focus: Annotated[float | None, "fitness FOCUS (Eq. 9.8)"]
    distance: Annotated[float | None, "mean distance from a RANGER to the nearest WILD at the end, in the book's units"]
    share_surrounded: Annotated[float | None, "share of WILDs surrounded at the end"]
    seconds: Annotated[float, "robot time of the run, in s"]


@dataclass(frozen=True)
class SurroundGenerationRecord:
    """What came of a generation of a genetic search among conditions."""

    search_seed: Annotated[int, "seed of the search"]
    number: Annotated[int, "number of the generation, from 1"]
    best: Annotated[float, "greatest fitness"]
    mean: Annotated[float, "mean fitness"]
    elite: Annotated[str, "the condition of the best, by the book's name"]
    cases: Annotated[tuple[str, ...], "its individuals, by the book's names"]


@dataclass(frozen=True)
class SurroundConditionRecord:
    """What several runs with the same seeds say of a condition, when a search is over."""

    search_seed: Annotated[int, "seed of the search"]
    case: Annotated[str, "the condition, by the book's name"]
    mean: Annotated[float, "mean of the fitness that was searched for"]
    sd: Annotated[float, "standard deviation of single runs"]
    runs: Annotated[int, "how many"]


@dataclass(frozen=True)
class CoachedRunRecord:
    """What came of one of several coachings that are put together."""

    number: Annotated[int, "number of the run, from 1"]
    seed: Annotated[int, "its seed"]
    maneuvers: Annotated[int, "maneuvers performed"]
    bouts: Annotated[int, "bouts begun"]
    wins: Annotated[int, "bouts won while it learnt"]
    losses: Annotated[int, "bouts lost while it learnt"]
    robot_seconds: Annotated[float, "s; time that the robot spent performing"]
    json: Annotated[str, "the advice file's content"]
    digest: Annotated[str, "of all its decisions, 16 hexadecimal digits"]
    outcomes: Annotated[tuple[int, ...], "how the bouts ended while it learnt, in order: 1 won, 2 lost, 3 drawn"]


@dataclass(frozen=True)
class TeamBoutsRecord:
    """Bouts that were played by an advice, on an emulated robot of their own."""

    what: Annotated[str, "what for: team exam"]
    first: Annotated[int, "number of the first of them, from 1"]
    outcomes: Annotated[tuple[int, ...], "how each ended: 1 won, 2 lost, 3 drawn"]
    times: Annotated[tuple[float, ...], "s; how long each took"]
    maneuvers: Annotated[tuple[int, ...], "maneuvers in each"]


@dataclass(frozen=True)
class TeamVerdictRecord:
    """What the team exam found out about an advice, or about a champion in the best advice so far."""

    run: Annotated[int, "number of the run that it comes from"]
    previous: Annotated[str, "previous stimulus of the champion's situation, or any; empty: the run's whole advice"]
    current: Annotated[str, "current stimulus of the champion's situation; empty likewise"]
    wins: Annotated[int, "bouts won"]
    trials: Annotated[int, "of how many"]
    seconds: Annotated[float, "s; time that they took together"]
    score: Annotated[float, "share of bouts won, less the cost of time"]
    kept: Annotated[bool, "it is, or is part of, the best advice from then on"]


RECORDS: Final = (
    WireBytes, RejectedInput, UnsentBytes, BridgeOpening, SessionDrawn, BridgeStep, EventRecord, DecisionRecord, CreditRecord,
    CheckpointRecord, TrialRecord, StepRecord,
    AdviceRecord, SwarmRoundRecord, SurroundStateRecord, SurroundEvaluationRecord, SurroundGenerationRecord,
    SurroundConditionRecord, CoachedRunRecord, TeamBoutsRecord, TeamVerdictRecord,
)  # fmt: skip
"""Every kind of entry defined here."""
