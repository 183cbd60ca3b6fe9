"""The exceptions of splatkit. All of them are subclasses of `Error`."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

from ._keywords import in_python


class Error(Exception):
    """An error of splatkit. Its subclasses say what a program can do about it."""


class ArgumentError(Error, ValueError):
    """An argument from which no picture can be made: an array of the wrong shape, a size of 0."""


class KindError(ArgumentError, TypeError):
    """An argument of a kind that is not taken, or of a name that there is not."""


class TransferError(ArgumentError):
    """A transfer function that cannot be used."""


class NothingToDrawError(Error):
    """The scene contains nothing visible."""


class InputError(Error):
    """A file that does not follow its format."""

    def __init__(self, file: str | Path, place: str, message: str, hint: str | None = None) -> None:
        super().__init__(file, place, message, hint)
        #: The file.
        self.file = Path(file)
        #: The place in the file: a line, an element, a byte.
        self.place = place
        #: What was found there and what was expected.
        self.message = message
        #: What can be done about it, if anything is known.
        self.hint = hint

    def __str__(self) -> str:
        hint = f" ({self.hint})" if self.hint else ""
        return f"{self.file}: {self.place}: {self.message}{hint}"


class LimitError(Error):
    """A file that exceeds the limits of reading, such as the number of points."""

    def __init__(self, file: str | Path, what: str, kind: str, found: int, limit: int) -> None:
        super().__init__(file, what, kind, found, limit)
        #: The file.
        self.file = Path(file)
        #: The quantity that exceeds the limit.
        self.what = what
        #: The name of the limit: points, bytes, depth, texels or seconds.
        self.kind = kind
        #: The value of the quantity.
        self.found = found
        #: The limit.
        self.limit = limit

    def __str__(self) -> str:
        text = f"{self.what} is {self.found}, over the limit of {self.limit}"
        return f"{self.file}: {text} (limits={{'{self.kind}': …}} raises it)"


class FileError(Error, OSError):
    """A file that the operating system could not open or read."""

    def __init__(
        self, file: str | Path, action: str, code: int | None = None, reason: str = ""
    ) -> None:
        super().__init__(code, reason, str(file))
        self._arguments = (file, action, code, reason)
        #: The file.
        self.file = Path(file)
        #: What failed, such as “cannot open”.
        self.action = action

    def __str__(self) -> str:
        return f"{self.file}: {self.action}: {self.strerror}"

    def __reduce__(self) -> tuple[object, ...]:
        return (type(self), self._arguments)


class MissingFileError(FileError, FileNotFoundError):
    """A file that does not exist."""


class DeniedFileError(FileError, PermissionError):
    """A file that may not be read."""


class OutputError(FileError):
    """A file that could not be written. A file that was there before is unchanged."""


class TimeLimitError(Error, TimeoutError):
    """Work on an input that takes longer than `limits={'seconds': …}` allows."""

    def __init__(self, what: str, limit: int, text: str) -> None:
        super().__init__(what, limit, text)
        #: The work that was stopped.
        self.what = what
        #: The limit in seconds.
        self.limit = limit
        self._text = text

    def __str__(self) -> str:
        return self._text

    def __reduce__(self) -> tuple[object, ...]:
        return (type(self), (self.what, self.limit, self._text))


class OutOfMemoryError(Error, MemoryError):
    """Memory that the system refused. It was requested before the work began."""

    def __init__(self, what: str, bytes: int, text: str) -> None:
        super().__init__(what, bytes, text)
        #: The work that needs the memory.
        self.what = what
        #: The number of bytes that were requested.
        self.bytes = bytes
        self._text = text

    def __str__(self) -> str:
        return self._text


class DataWarning(UserWarning):
    """What a file holds and a picture does not show: missing values, elements left out."""


_FOLDER = str(Path(__file__).parent)


def made(name: str, *arguments: object) -> Error:
    """Returns an exception of the library, with keywords instead of flags in its texts."""
    texts = [in_python(one) if isinstance(one, str) else one for one in arguments]
    error = globals()[name](*texts)
    assert isinstance(error, Error)
    return error


def warn(message: str) -> None:
    """Warns at the line outside this package that has called it, however deep inside it is."""
    frame, level = sys._getframe(), 1
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_FOLDER):
        frame, level = frame.f_back, level + 1
    warnings.warn(in_python(message), DataWarning, stacklevel=level)
