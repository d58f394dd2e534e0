"""Exceptions, warnings, and the diagnostics that they carry."""

from __future__ import annotations

import os
import sys
import unicodedata
import warnings
from typing import NamedTuple


# Characters that change the direction of writing.
_DIRECTIONS = "\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\u200e\u200f"


def _printable(text: str) -> str:
    """Returns the text with control characters replaced by their numbers, as the command prints them."""

    def is_command(c: str) -> bool:
        return unicodedata.category(c) == "Cc" and c not in "\n\t" or c in _DIRECTIONS

    return "".join(f"\\u{{{ord(c):x}}}" if is_command(c) else c for c in text)


class Diagnostic(NamedTuple):
    """One finding: message, place and help. docs/reference/codes.md lists the codes."""

    code: str
    """Identity, as in "FB307"."""
    severity: str
    """"note", "warning" or "error"."""
    message: str
    """Message with the facts."""
    file: str | None
    """File that the message is about."""
    line: int | None
    """Line of that file, from 1."""
    help: str
    """Next step, in the imperative."""

    def __str__(self) -> str:
        name = _printable((self.file or "").replace("\n", "\\n"))
        place = f"\n  in {name}" if name else ""
        place += f", line {self.line}" if name and self.line else ""
        return f"{self.severity}[{self.code}]: {_printable(self.message)}{place}\n  help: {_printable(self.help)}"


class FlexbodyError(Exception):
    """An error of the library. Each exit code of the command has one subclass."""

    exit_code: int
    """Exit code of the command `flexbody` for the same error."""
    diagnostics: tuple[Diagnostic, ...]
    """All findings up to the error, warnings and notes included."""

    def __init__(self, diagnostics: tuple[Diagnostic, ...] = (), exit_code: int = 70) -> None:
        super().__init__(diagnostics, exit_code)
        self.diagnostics = tuple(diagnostics)
        self.exit_code = exit_code

    @property
    def codes(self) -> tuple[str, ...]:
        """Codes of the errors among the diagnostics."""
        return tuple(one.code for one in self.diagnostics if one.severity == "error")

    def __str__(self) -> str:
        return "\n".join(map(str, self.diagnostics))


class CheckError(FlexbodyError):
    """A check failed or a tolerance was exceeded; the inputs themselves were readable. Exit code 1."""


class InputError(FlexbodyError, ValueError):
    """Bad input. Exit code 2."""


class ArgumentError(InputError, TypeError):
    """An argument of a wrong type. Exit code 2."""


class NumericalError(FlexbodyError, ArithmeticError):
    """No trustworthy numerical result: not converged, a mechanism, an indefinite matrix. Exit code 3."""


class ResourceError(FlexbodyError):
    """Not enough memory or disk, or an output that cannot be written. Exit code 4."""


class InternalError(FlexbodyError, RuntimeError):
    """A bug of the library. Exit code 70."""


class FlexbodyWarning(UserWarning):
    """A warning of the library."""

    diagnostic: Diagnostic

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic)
        self.diagnostic = diagnostic

    def __str__(self) -> str:
        return _printable(f"{self.diagnostic.message} [{self.diagnostic.code}]; {self.diagnostic.help}")


_CLASSES = {1: CheckError, 2: InputError, 3: NumericalError, 4: ResourceError, 70: InternalError}


def error_of(exit_code: int, diagnostics: tuple[Diagnostic, ...]) -> FlexbodyError:
    """Returns the exception of the class that belongs to the exit code."""
    return _CLASSES.get(exit_code, FlexbodyError)(diagnostics, exit_code)


_HELP = "give the argument as the documentation of the function describes it"


def _of_argument(message: str, help_text: str) -> tuple[Diagnostic]:
    return (Diagnostic("FB804", "error", message, None, None, help_text),)


def value_error(message: str, help_text: str = _HELP) -> InputError:
    """Returns the exception for an argument whose value is not possible."""
    return InputError(_of_argument(message, help_text), 2)


def type_error(message: str, help_text: str = _HELP) -> ArgumentError:
    """Returns the exception for an argument of a wrong type."""
    return ArgumentError(_of_argument(message, help_text), 2)


def warn(warning: Warning) -> None:
    """Issues a warning that points to the first caller outside of this package."""
    here, level = os.path.dirname(__file__), 1
    frame = sys._getframe()
    while frame.f_back is not None and os.path.dirname(frame.f_code.co_filename) == here:
        frame, level = frame.f_back, level + 1
    warnings.warn(warning, stacklevel=level)
