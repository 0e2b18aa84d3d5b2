"""Verbs that are listed by name, and imported when they are called."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any, ClassVar, Final

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from hil.cli.completion import described
from hil.cli.help_page import HELP, HelpContext
from hil.cli.loading import loading

INTERRUPTED: Final = 130
"""Exit status, as of every verb that is interrupted."""


@dataclass(frozen=True)
class Verb:
    """A verb that need not be imported to be listed.

    Attributes:
        name: As it is called.
        home: Module and name of the function that does it, or of the application that has sub-commands, as
            `hil.cli.coach:coach`.
        summary: The first sentence of its help.
    """

    name: str
    home: str
    summary: str

    def load(self) -> Any:  # noqa: ANN401 - typer brings a click of its own, or not
        """Import the verb.

        Returns:
            The command.
        """
        module, _, name = self.home.partition(":")
        try:
            with loading():
                found = getattr(import_module(module), name)
                if isinstance(found, typer.Typer):
                    return get_command(found)
                from hil.cli.arguments import Subcommand  # noqa: PLC0415 - as the verb itself
                from hil.cli.common import guarded  # noqa: PLC0415 - likewise
        except KeyboardInterrupt:  # loading takes a moment
            raise typer.Exit(INTERRUPTED) from None
        app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
        app.command(self.name, cls=Subcommand, context_settings=HELP)(guarded(found))
        return get_command(app)


class Listed(TyperCommand):
    """A verb in a list.

    Args:
        verb: The verb.
    """

    def __init__(self, verb: Verb) -> None:
        super().__init__(verb.name, help=verb.summary, rich_markup_mode=None)
        self.verb = verb

    def get_short_help_str(self, limit: int = 0) -> str:  # noqa: ARG002 - whole, however narrow the terminal
        """The summary."""
        return self.verb.summary


class VerbGroup(TyperGroup):
    """A group of verbs, each imported when it is called.

    Attributes:
        VERBS: The verbs, in the order in which they are listed.
    """

    VERBS: ClassVar[tuple[Verb, ...]] = ()
    context_class = HelpContext

    def __init__(self, **settings: Any) -> None:  # noqa: ANN401 - typer's
        super().__init__(**settings)
        self.commands = {verb.name: Listed(verb) for verb in self.VERBS}

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:  # noqa: ANN401 - typer brings a click of its own, or not
        """Find the verb that is called, and import it; a shell that completes is told its options without that."""
        name, command, rest = super().resolve_command(ctx, args)
        if not isinstance(command, Listed):
            return name, command, rest
        known = described(command.verb.home) if ctx.resilient_parsing else None
        return name, known or command.verb.load(), rest


def group_of(name: str, verbs: type[VerbGroup], text: str, *, shows_help: bool = True) -> typer.Typer:
    """An application of verbs that is a verb itself.

    Args:
        name: As it is called.
        verbs: Its verbs.
        text: Its help.
        shows_help: Without a verb it shows its help.
    """
    app = typer.Typer(
        name=name,
        cls=verbs,
        help=text,
        no_args_is_help=shows_help,
        context_settings=HELP,
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
    )

    @app.callback()
    def _none() -> None:
        """Take what comes before the sub-command: nothing."""

    return app
