"""The file of `--signing-key`: a key for message signing as bytes, as hexadecimal digits or as a passphrase."""

import hashlib
from pathlib import Path

__all__ = ["KEY_SIZE", "SigningError", "read_key"]

KEY_SIZE = 32  # [bytes]
LARGEST_FILE = 4096  # [bytes]: no passphrase is longer


class SigningError(ValueError):
    """A key that cannot be had; the text says which file, why and what was expected. It never shows the key."""


def read_key(path: Path) -> bytes:
    """The key (32 bytes) in a file.

    Exactly 32 bytes are the key itself, unless they are a line of text with its line end. Otherwise the file holds one
    line: 64 hexadecimal digits, or a passphrase, whose SHA-256 is the key, as MAVProxy and Mission Planner have it.
    Raises SigningError.
    """
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise _error(path, str(error.strerror)) from None
    line = _line(content)
    if len(content) == KEY_SIZE and not (line is not None and content.endswith(b"\n")):
        key = content
    elif line is None or len(content) > LARGEST_FILE:
        raise _error(path, f"{len(content)} bytes that are none of these" if content.strip() else "nothing")
    else:
        key = _from_digits(line) or hashlib.sha256(line.encode()).digest()
    if not any(key):
        raise _error(path, "only zeros, which everybody knows")
    return key


def _line(content: bytes) -> str | None:
    """The one line of text that the bytes are, without its end; None if they are something else, or blank."""
    try:
        text = content.decode()
    except UnicodeDecodeError:
        return None
    line = text.removesuffix("\n").removesuffix("\r")
    return line if line.isprintable() and line.strip() else None


def _from_digits(line: str) -> bytes | None:
    try:
        key = bytes.fromhex(line)
    except ValueError:
        return None
    return key if len(key) == KEY_SIZE else None


def _error(path: Path, got: str) -> SigningError:
    return SigningError(
        f"signing key {path}: expected 32 bytes, 64 hexadecimal digits or one line with a passphrase, got {got}"
    )
