"""What a sumo robot's run has to say for its log: decisions, trials, generations, bouts, advice."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from dataclasses import asdict
from typing import TYPE_CHECKING

from firmware_protocol.vocabulary import stimulus_label
from hil.mcaplog.records import (
    SERIES,
    AdviceRecord,
    CheckpointRecord,
    CoachedRunRecord,
    CreditRecord,
    DecisionRecord,
    StepRecord,
    TeamBoutsRecord,
    TeamVerdictRecord,
    TrialRecord,
)
from hil.sumo.challenging import challenge_in_words, facts

if TYPE_CHECKING:
    from collections.abc import Mapping
    from enum import IntEnum

    from hil.sumo.bouts import Bout
    from hil.sumo.ring import Encounter
    from hil.sumo.team import CoachedRun, PlayedBouts
    from pal_advisor.maneuvers import Challenge, ChallengeVerdict, Credit, GenerationRecord, Performance, TeamVerdict, Trial


class SumoLog(ABC):
    """Puts what is told of a run into the entries of a log, which whoever derives from it as from `WireLog` writes.

    Attributes:
        now: Log time of what is told, in s.
    """

    now: float

    @abstractmethod
    def note(self, kind: str, text: str, **fields: object) -> None:
        """See `WireLog.note`."""

    @abstractmethod
    def record(self, topic: str, record: object, time: float, kind: type | None = None) -> None:
        """See `WireLog.record`."""

    def series(self, title: str) -> None:
        """What follows belongs together: `coaching`, `bouts played by the advice`, `bouts played by random maneuvers`."""
        self.note(SERIES, title)

    def decision(self, trial: Trial) -> None:
        """The learner asks for a maneuver.

        Args:
            trial: What it asks for, and why.
        """
        previous, current = (stimulus_label(code) for code in trial.category)
        record = DecisionRecord(
            trial=trial.id,
            phase=trial.phase,
            exam=trial.exam,
            generation=trial.generation,
            tried=trial.tried,
            previous=previous,
            current=current,
            actions=str(trial.maneuver),
            motive=trial.motive,
            origin=trial.origin,
            parents=trial.parents,
            digest=trial.digest,
            expected=trial.expected,
            error=trial.error,
            mirrored=trial.mirrored,
        )
        self.record("/pal/decision", record, self.now)

    def credit(self, credit: Credit) -> None:
        """The learner was told something, and has credited it.

        Args:
            credit: What to which trials.
        """
        record = CreditRecord(
            trial=credit.trial,
            telling=credit.telling,
            trials=credit.trials,
            credits=credit.credits,
            rated=credit.rated,
            fitness=credit.fitness,
            digest=credit.digest,
        )
        self.record("/pal/credit", record, self.now)

    def checkpoint(self, used: int, digest: str) -> None:
        """A checkpoint was due.

        Args:
            used: Maneuvers performed by then.
            digest: Of the learner's whole state.
        """
        self.record("/pal/checkpoint", CheckpointRecord(used, digest), self.now)

    def coached_run(self, number: int, run: CoachedRun) -> None:
        """One of several coachings is over.

        Args:
            number: Its number, from 1.
            run: What came of it.
        """
        self.record("/pal/run", CoachedRunRecord(number=number, **vars(run)), self.now)

    def team_bouts(self, what: str, first: int, played: PlayedBouts) -> None:
        """Bouts were played elsewhere.

        Args:
            what: What for.
            first: Number of the first.
            played: What came of them.
        """
        record = TeamBoutsRecord(what, first, played.outcomes, played.times, played.maneuvers)
        self.record("/pal/bouts", record, self.now)

    def team_verdict(self, verdict: TeamVerdict) -> None:
        """The team exam has found something out.

        Args:
            verdict: What.
        """
        previous, current = ("", "") if verdict.category is None else (stimulus_label(code) for code in verdict.category)
        score = verdict.score
        record = TeamVerdictRecord(
            verdict.run, previous, current, score.wins, score.trials, score.seconds, score.value, verdict.kept
        )
        self.record("/pal/verdict", record, self.now)

    def challenge_verdict(self, verdict: ChallengeVerdict) -> None:
        """A pair of a challenge is complete.

        Args:
            verdict: How it stands.
        """
        left = f"won by the {verdict.winner}" if verdict.winner else "it goes on"
        self.note(
            "challenge",
            f"challenge, pair {verdict.pair}: {verdict.ahead} ahead, {verdict.behind} behind; {left}",
            **asdict(verdict),
        )

    def challenge(self, challenge: Challenge) -> None:
        """A challenge is over.

        Args:
            challenge: It.
        """
        self.note("challenge", challenge_in_words(challenge), **facts(challenge))

    def trial(self, trial: Trial, encounter: Encounter, performance: Performance, fitness: float) -> None:
        """A maneuver was performed for the learner.

        Args:
            trial: What the learner asked for.
            encounter: What the robot did.
            performance: What the learner was told of it.
            fitness: What that was worth to the learner.
        """
        previous, current = (stimulus_label(code) for code in trial.category)
        record = TrialRecord(
            id=trial.id,
            previous=previous,
            current=current,
            phase=trial.phase,
            exam=trial.exam,
            actions=str(trial.maneuver),
            period=trial.maneuver.period,
            fitness=fitness,
            performed=len(performance.tallies),
            won=performance.won,
            lost=performance.lost,
            progress=performance.progress,
            duration=encounter.duration,
            ended=_words(encounter.report.outcome),
        )
        self.record("/pal/trial", record, self.now)

    def generation(self, generation: GenerationRecord) -> None:
        """The learner has made a step in one category.

        Args:
            generation: The state of that category.
        """
        previous, current = (stimulus_label(code) for code in generation.category)
        record = StepRecord(
            previous=previous,
            current=current,
            phase=generation.phase,
            generation=generation.generation,
            used=generation.used,
            evaluations=generation.evaluations,
            best=generation.best,
            mean=generation.mean,
            actions=generation.maneuver,
        )
        self.record("/pal/generation", record, self.now)

    def bout(self, bout: Bout) -> None:
        """A bout ended."""
        outcome = _words(bout.outcome)
        self.note(
            "bout",
            f"bout {bout.number}: {outcome} after {bout.time:.1f} s",
            number=bout.number,
            seed=bout.seed,
            outcome=outcome,
            time=bout.time,
            maneuvers=bout.maneuvers,
        )

    def interrupted(self, bout: int, error: str) -> None:
        """The robot was lost in a bout, which will be begun again.

        Args:
            bout: Number of the bout.
            error: What was said of the loss.
        """
        self.note("bout", f"bout {bout} is interrupted: {error}", number=bout, outcome="interrupted")

    def advice(self, advice: Mapping[str, object]) -> None:
        """The advice as it stands, as plain values (what the advice file holds)."""
        self.record("/pal/advice", AdviceRecord(json.dumps(advice, sort_keys=True)), self.now)


def _words(member: IntEnum) -> str:
    return member.name.lower().replace("_", " ")
