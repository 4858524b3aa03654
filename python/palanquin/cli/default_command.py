"""A group of commands one of which runs when none is named: `demo trot` beside `demo bar`."""

from __future__ import annotations

from typing import Any

from typer.core import TyperGroup

DEFAULT = "scenario"


class DefaultCommandGroup(TyperGroup):
    """Hands arguments that do not begin with a command's name to the command `DEFAULT`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Puts the default command's name first where no command is named."""
        if not args or args[0] not in self.commands:
            args = [DEFAULT, *args]
        return super().parse_args(ctx, args)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The default command goes by the group's own name, and its help tells of the others."""
        name, command, rest = super().resolve_command(ctx, args)
        if name == DEFAULT and command is not None:
            others = [f"`{ctx.command_path} {other} --help`" for other in self.commands]
            others.remove(f"`{ctx.command_path} {DEFAULT} --help`")
            command.epilog = f"There is also {', '.join(others)}." if others else None
            name = ""
        return name, command, rest
