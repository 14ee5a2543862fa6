"""Completion of the command line in the shell, written from the parser itself: it knows every option there is."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping

from growthx.cli.command import Command
from growthx.cli.machine.ranks import first_rank
from growthx.common.errors import InputError

_BASH = """\
_growthx() {{
    local word=${{COMP_WORDS[COMP_CWORD]}} options=
    case ${{COMP_WORDS[1]}} in
{cases}
    esac
    [ "$COMP_CWORD" -gt 1 ] || options="{commands}"
    COMPREPLY=()
    case $word in
        -*) COMPREPLY=($(compgen -W "$options" -- "$word")) ;;
        *) [ "$COMP_CWORD" -gt 1 ] || COMPREPLY=($(compgen -W "$options" -- "$word")) ;;
    esac
}}
complete -o default -F _growthx growthx
"""
_ZSH = "autoload -U +X bashcompinit && bashcompinit\n"
_INSTALL = {
    "bash": 'eval "$(growthx completion bash)" in ~/.bashrc',
    "zsh": 'eval "$(growthx completion zsh)" in ~/.zshrc, after compinit',
    "fish": "growthx completion fish | source in ~/.config/fish/config.fish",
}
_HOW = "; ".join(f"{shell}: {how}" for shell, how in _INSTALL.items())


def options_of(parser: argparse.ArgumentParser) -> dict[str, str]:
    """Long options of a parser, with their explanations."""
    return {
        name: (action.help or "").replace("%%", "%")
        for action in parser._actions
        for name in action.option_strings
        if name.startswith("--") and action.help != argparse.SUPPRESS
    }


def _bash(parsers: Mapping[str, argparse.ArgumentParser]) -> str:
    cases = "\n".join(f'        {name}) options="{" ".join(options_of(one))}" ;;' for name, one in parsers.items())
    return _BASH.format(cases=cases, commands=" ".join((*parsers, "--help", "--version")))


def _fish(parsers: Mapping[str, argparse.ArgumentParser]) -> str:
    lines = [f"complete -c growthx -n __fish_use_subcommand -a '{' '.join(parsers)}' -f"]
    for name, parser in parsers.items():
        for option, text in options_of(parser).items():
            told = text.replace("\\", "\\\\").replace("'", "\\'")
            lines.append(f"complete -c growthx -n '__fish_seen_subcommand_from {name}' -l {option[2:]} -d '{told}'")
    return "\n".join(lines) + "\n"


_SHELLS: Mapping[str, Callable[[Mapping[str, argparse.ArgumentParser]], str]] = {
    "bash": _bash,
    "zsh": lambda parsers: _ZSH + _bash(parsers),
    "fish": _fish,
}


def completion(words: Mapping[str, argparse.ArgumentParser]) -> Command:
    """The command that prints the completion of all commands; words: filled with their parsers later on."""

    def arguments(parser: argparse.ArgumentParser) -> None:
        parser.add_argument(
            "shell", metavar="SHELL", help="; ".join(f"{name}: {how}" for name, how in _INSTALL.items())
        )

    def run(options: argparse.Namespace) -> int:
        if options.shell not in _SHELLS:
            raise InputError(
                f"there is no completion for the shell '{options.shell}': {', '.join(_SHELLS)} would be right"
            )
        if first_rank():
            print(_SHELLS[options.shell](words), end="")
        return 0

    return Command("completion", "completion of commands and options in the shell", arguments, run)
