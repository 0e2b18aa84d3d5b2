"""What the firmware takes on an ATmega328P, and whether it fits.

Flash and static RAM are what the linker placed. The stack is the deepest chain of calls: every function's own need (what
the compiler reports by -fstack-usage; for library functions what the disassembly pushes and reserves) added up along the
call graph that the disassembly shows, from `main`; plus the deepest interrupt handler, which may strike at the worst
moment. Recursion and calls through pointers can't be bounded and are errors.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from bisect import bisect_right
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

FLASH_LIMIT: Final = 24 * 1024
"""Bytes of flash that the firmware may take."""
RAM_LIMIT: Final = 1600
"""Bytes of RAM: static plus deepest stack."""
RETURN_ADDRESS: Final = 2

_FUNCTION = re.compile(r"^([0-9a-f]+) <([^>]+)>:$")
_INSTRUCTION = re.compile(r"^\s*[0-9a-f]+:\t[0-9a-f ]+\t(\w+)\s*([^;]*)(?:;\s*0x([0-9a-f]+))?")
_CALLS = {"call", "rcall"}
_JUMPS = {"jmp", "rjmp"}
_ENDS = {"ret", "reti", *_JUMPS}


@dataclass
class DisassembledFunction:
    """One function as the disassembly shows it.

    Attributes:
        name: Its name; static functions of different files may share one.
        frame: Own stack in bytes, return address included.
        calls: Addresses it calls.
        jumps: Addresses it jumps to.
        indirect: It calls or jumps through a pointer.
        falls_through: It runs on into what follows it.
    """

    name: str
    frame: int = RETURN_ADDRESS
    calls: set[int] = field(default_factory=set)
    jumps: set[int] = field(default_factory=set)
    indirect: bool = False
    falls_through: bool = False


def read_functions(disassembly: str) -> dict[int, DisassembledFunction]:
    """Find every function's stack need and calls.

    Args:
        disassembly: Output of `avr-objdump -d`.

    Returns:
        Functions by address.
    """
    functions: dict[int, DisassembledFunction] = {}
    function = DisassembledFunction("")
    low = 0
    for line in disassembly.splitlines():
        if start := _FUNCTION.match(line):
            function = functions[int(start[1], 16)] = DisassembledFunction(start[2])
            low = 0
            continue
        instruction = _INSTRUCTION.match(line)
        if instruction is None:
            continue
        operation, operands = instruction[1], instruction[2].strip()
        target = int(instruction[3], 16) if instruction[3] else -1
        function.falls_through = operation not in _ENDS
        if operation == "push" or (operation in _CALLS and operands == ".+0"):
            function.frame += 1 if operation == "push" else RETURN_ADDRESS  # the compiler's short way to reserve two
        elif operation == "sbiw" and operands.startswith("r28,"):
            function.frame += int(operands.split(",")[1], 0)
        elif operation == "subi" and operands.startswith("r28,"):
            low = int(operands.split(",")[1], 0)
        elif operation == "sbci" and operands.startswith("r29,"):
            reserved = low + 256 * int(operands.split(",")[1], 0)
            function.frame += reserved if reserved < 0x8000 else 0  # more is the addition that gives the frame back
        elif operation in {"icall", "ijmp", "eicall", "eijmp"}:
            function.indirect = True
        elif operation in _CALLS:
            function.calls.add(target)
        elif operation in _JUMPS or operation.startswith("br"):
            function.jumps.add(target)
    return functions


class CallGraph:
    """Who calls whom.

    The routines of the compiler's library are assembler with many labels that jump among each other: labels joined by
    jumps are one routine, whose need is the sum of what is pushed anywhere in it, a return address for every call of one
    label by another included.

    Args:
        functions: The functions by address.
        compiled: Names of those that the C compiler made.
    """

    def __init__(self, functions: dict[int, DisassembledFunction], compiled: set[str]) -> None:
        self._functions = functions
        self._compiled = compiled
        self._addresses = sorted(functions)
        self._routine = {address: address for address in self._addresses}
        for address, following in zip(self._addresses, [*self._addresses[1:], -1], strict=True):
            function = functions[address]
            if function.name in compiled:
                continue
            joined = {self.function_at(target) for target in function.jumps}
            if function.falls_through and following >= 0:
                joined.add(following)
            for other in joined:
                if functions[other].name not in compiled:
                    self._join(address, other)

    def function_at(self, address: int) -> int:
        """Address of the function that an address lies in."""
        return self._addresses[bisect_right(self._addresses, address) - 1]

    def _inside(self, address: int, routine: int) -> bool:
        return self._routine[self.function_at(address)] == routine

    def _join(self, one: int, other: int) -> None:
        old, new = self._routine[one], self._routine[other]
        self._routine = {address: new if routine == old else routine for address, routine in self._routine.items()}

    def deepest(self, start: int) -> tuple[int, list[tuple[str, int]]]:
        """Find the chain of calls that needs the most stack.

        Args:
            start: Address of the function it begins with.

        Returns:
            Bytes, and the chain: name and own need of every function.

        Raises:
            ValueError: Recursion, or a call through a pointer.
        """
        known: dict[int, tuple[int, list[tuple[str, int]]]] = {}
        under_way: list[int] = []

        def visit(address: int) -> tuple[int, list[tuple[str, int]]]:
            routine = self._routine[self.function_at(address)]
            if routine in known:
                return known[routine]
            if routine in under_way:
                raise ValueError("recursion: " + " -> ".join(self._functions[a].name for a in [*under_way, routine]))
            parts = [self._functions[a] for a, r in self._routine.items() if r == routine]
            if any(part.indirect for part in parts):
                raise ValueError(f"{parts[0].name} calls through a pointer")
            under_way.append(routine)
            frame = sum(part.frame - RETURN_ADDRESS for part in parts) + RETURN_ADDRESS
            targets = {target for part in parts for target in part.calls | part.jumps if not self._inside(target, routine)}
            calls = [target for part in parts for target in part.calls]
            frame += RETURN_ADDRESS * sum(self._inside(target, routine) for target in calls)
            if parts[0].name in self._compiled and any(self._inside(target, routine) for target in calls):
                raise ValueError(f"{parts[0].name} calls itself")
            below = max((visit(target) for target in sorted(targets)), default=(0, []))
            under_way.pop()
            known[routine] = (frame + below[0], [(parts[0].name, frame), *below[1]])
            return known[routine]

        return visit(start)


def read_usage(folder: Path) -> dict[str, int]:
    """Read what the compiler says of its own functions.

    Args:
        folder: Where the `.su` files are.

    Returns:
        The largest need in bytes by function name.

    Raises:
        ValueError: A function's need is not bounded.
    """
    usage: dict[str, int] = {}
    for path in sorted(folder.rglob("*.su")):
        for line in path.read_text().splitlines():
            where, size, kind = line.split("\t")
            name = where.rsplit(":", 1)[1]
            if "dynamic" in kind and "bounded" not in kind:
                raise ValueError(f"{name}: stack need is not bounded")
            usage[name] = max(usage.get(name, 0), int(size))
    return usage


def run(*command: str) -> str:
    """Run a tool of the toolchain and return what it prints."""
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout  # noqa: S603


def main() -> int:
    """Print the report.

    Returns:
        0 when the firmware fits, 1 when it does not.
    """
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--elf", required=True, help="linked firmware")
    parser.add_argument("--usage", required=True, type=Path, help="folder of the compiler's .su files")
    parser.add_argument("--objdump", default="avr-objdump")
    parser.add_argument("--size", default="avr-size")
    parser.add_argument("--flash-limit", type=int, default=FLASH_LIMIT, help="bytes (default %(default)s)")
    parser.add_argument("--ram-limit", type=int, default=RAM_LIMIT, help="bytes (default %(default)s)")
    options = parser.parse_args()

    text, data, bss = (int(figure) for figure in run(options.size, options.elf).splitlines()[1].split()[:3])
    functions = read_functions(run(options.objdump, "-d", options.elf))
    usage = read_usage(options.usage)
    for function in functions.values():
        function.frame = usage.get(function.name, function.frame)
    graph = CallGraph(functions, set(usage))
    entry = {function.name: address for address, function in functions.items()}
    stack, chain = graph.deepest(entry["main"])
    handlers = [graph.deepest(address)[0] for name, address in entry.items() if name.startswith("__vector_")]
    interrupt = max(handlers)
    flash, ram = text + data, data + bss + stack + interrupt

    print(f"flash   {flash:6} of {options.flash_limit} bytes")  # noqa: T201
    print(f"RAM     {ram:6} of {options.ram_limit} bytes: static {data + bss}, stack {stack}, interrupts {interrupt}")  # noqa: T201
    print("deepest " + " > ".join(f"{name} {frame}" for name, frame in chain))  # noqa: T201
    if flash > options.flash_limit or ram > options.ram_limit:
        print("too large", file=sys.stderr)  # noqa: T201
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
