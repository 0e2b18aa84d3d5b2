"""Checks a log against the rules of the MCAP specification, and against ours: what is broken, and where.

A rule says what must be so of any file; what the specification leaves open (no chunks, no index, no checksums) is no finding.
Rules of ours hold for logs whose header names this program as what wrote them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from mcap.opcode import Opcode

from hil.mcaplog.checking.data import DataRules
from hil.mcaplog.checking.summary import SummaryRules
from hil.mcaplog.limits import MIB, ReadLimits
from hil.mcaplog.reading.unpacking import DAMAGE, RECORD_HEAD
from hil.mcaplog.reading.walking import WalkedLog, shown
from hil.mcaplog.writing.writer import LIBRARY, MAGIC

if TYPE_CHECKING:
    from pathlib import Path

MOST_FINDINGS: Final = 20
"""That are kept of each rule; all are counted."""
LONGEST_FINDING: Final = 250
_NAMES: Final = {int(opcode): opcode.name.lower().replace("_", " ") for opcode in Opcode}
RULES: Final[dict[str, str]] = {
    "magic": "the file begins and ends with MCAP's eight bytes",
    "records": "every record is whole, and as its kind demands",
    "order": "header, data, end of data, summary, summary offsets, footer; in each only what belongs there",
    "schemas": "a schema has a number other than 0, and one number one content",
    "channels": "a channel comes after its schema, and one number has one content",
    "messages": "an entry comes after its channel",
    "chunks": "a chunk unpacks to the size, the checksum and the times that it says, and holds entries and what describes them",
    "message indexes": "message indexes follow their chunk, and have every entry of their channel where it is",
    "attachments": "an attachment has its checksum",
    "data checksum": "the end of the data has the checksum of the data, where it has one",
    "summary checksum": "the footer has the checksum of the summary, where it has one",
    "summary": "records of one kind stand together in the summary, and the footer and the summary offsets say where",
    "repeated": "schemas and channels in the summary are those in the data",
    "chunk indexes": "the indexes of chunks are as the chunks are",
    "attachment indexes": "the indexes of attachments are as the attachments are",
    "metadata indexes": "the indexes of metadata are as the metadata are",
    "statistics": "the statistics count what is there",
    "entries": "every entry is what its schema says",
}
OURS: Final[dict[str, str]] = {
    "our index": "the summary has statistics, schemas, channels, indexes of attachments, metadata, and, unless slim, of chunks",
    "our metadata": "the first metadata record is `run`, and there is one `config`",
    "our sizes": "the metadata record `sizes`, where there is one, has the bytes of each topic",
    "our numbers": "the sequence numbers of a channel go up, where it has any",
    "our clock": "the readings of the clock in /bridge/step never go back, on each network",
}


@dataclass(frozen=True)
class Violation:
    """Something that is against a rule.

    Attributes:
        text: What, in words.
        offset: At which byte of the file.
    """

    text: str
    offset: int


@dataclass
class CheckedRule:
    """A rule, and what is against it.

    Attributes:
        name: Its name.
        demand: What it demands.
        count: How often it is broken.
        findings: The first of them.
    """

    name: str
    demand: str
    count: int = 0
    findings: list[Violation] = field(default_factory=list)

    @property
    def passed(self) -> bool:
        """Nothing is against it."""
        return not self.count


@dataclass
class CheckedLog:
    """A log, and how it stands with each rule.

    Attributes:
        path: The log.
        ours: This program wrote it, and our own rules hold.
        rules: The rules that hold for it, by name.
    """

    path: Path
    ours: bool = False
    rules: dict[str, CheckedRule] = field(default_factory=lambda: {n: CheckedRule(n, d) for n, d in RULES.items()})

    @property
    def passed(self) -> bool:
        """Nothing is against any rule."""
        return all(rule.passed for rule in self.rules.values())

    def report(self, rule: str, offset: int, text: str) -> None:
        """Something is against a rule; nothing happens where the rule does not hold for this log."""
        found = self.rules.get(rule)
        if found is not None:
            found.count += 1
            if len(found.findings) < MOST_FINDINGS:
                found.findings.append(Violation(shown(text, LONGEST_FINDING), offset))


def check_log(path: Path, limits: ReadLimits = ReadLimits()) -> CheckedLog:  # noqa: B008 - frozen
    """Check a log.

    Args:
        path: The log.
        limits: What it may unpack to.

    Returns:
        What is against which rule.

    Raises:
        LogError: It cannot be opened or is not a log.
    """
    log = WalkedLog(path, limits)
    checked = CheckedLog(path)
    data = DataRules(checked.report, limits, log.size)
    summary = SummaryRules(checked.report, data)
    _walk(log, checked, data, summary)
    if checked.ours:
        summary.finish_ours()
        data.finish_ours()
    return checked


def _walk(log: WalkedLog, checked: CheckedLog, data: DataRules, summary: SummaryRules) -> None:
    with log.path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            checked.report("magic", 0, "the file ends within its first bytes")
            return
        data.begin(MAGIC)
        while True:
            offset = file.tell()
            head = file.read(RECORD_HEAD.size)
            if len(head) < RECORD_HEAD.size:
                checked.report("order", offset, "the file ends without a footer")
                break
            opcode, length = RECORD_HEAD.unpack(head)
            if not opcode or offset + len(head) + length > log.size:
                what = (
                    "there is no record" if not opcode else f"a record of {length:,} bytes goes on behind the end of the file"
                )
                checked.report("records", offset, what)
                return
            if length > log.limits.chunk:
                checked.report("records", offset, f"a record of {length:,} bytes was not looked at")
                data.pass_over(head)
                for _ in range(0, length, MIB):
                    data.pass_over(file.read(min(MIB, offset + len(head) + length - file.tell())))
                continue
            content = file.read(length)
            try:
                _take(checked, data, summary, (opcode, offset, head, content))
            except DAMAGE as error:
                checked.report(
                    "records", offset, f"a {_name(opcode)} can't be read ({str(error)[:100] or type(error).__name__})"
                )
            if opcode == Opcode.FOOTER:
                break
        if file.read(len(MAGIC) + 1) != MAGIC:
            checked.report("magic", file.tell(), "the file does not end with MCAP's eight bytes behind the footer")


def _take(checked: CheckedLog, data: DataRules, summary: SummaryRules, record: tuple[int, int, bytes, bytes]) -> None:
    opcode, offset, head, content = record
    if offset == len(MAGIC):
        if opcode != Opcode.HEADER:
            checked.report("order", offset, "the first record is no header")
        else:
            data.header(content)
            checked.ours = data.library == LIBRARY
            if checked.ours:
                checked.rules.update({name: CheckedRule(name, demand) for name, demand in OURS.items()})
            data.pass_over(head + content)
            return
    if data.ended:
        summary.take(opcode, offset, head, content)
    elif data.take(opcode, offset, head, content):
        summary.begin(offset + len(head) + len(content))


def _name(opcode: int) -> str:
    return _NAMES.get(opcode, "record")
