"""The file of --signing-key."""

import hashlib
from pathlib import Path

import pytest

from sitl.mavlink.signing_key import SigningError, read_key


@pytest.mark.parametrize(
    ("content", "key"),
    [
        (bytes(range(32)), bytes(range(32))),
        (b"*" * 32, b"*" * 32),
        (b"\n" * 31 + b"\x80", b"\n" * 31 + b"\x80"),
        (b"00ff" * 16, b"\x00\xff" * 16),
        (b"00FF" * 16 + b"\r\n", b"\x00\xff" * 16),
        (b"correct horse\n", hashlib.sha256(b"correct horse").digest()),
        (b"correct horse", hashlib.sha256(b"correct horse").digest()),
        (b"a passphrase of 31 characters..\n", hashlib.sha256(b"a passphrase of 31 characters..").digest()),
        ("Grüße\n".encode(), hashlib.sha256("Grüße".encode()).digest()),
        (b"00ff", hashlib.sha256(b"00ff").digest()),
    ],
)
def test_a_key_comes_as_bytes_as_digits_or_as_a_passphrase_whose_hash_it_is(
    tmp_path: Path, content: bytes, key: bytes
) -> None:
    file = tmp_path / "key"
    file.write_bytes(content)
    assert read_key(file) == key


@pytest.mark.parametrize(
    ("content", "got"),
    [
        (b"", "nothing"),
        (b" \n", "nothing"),
        (b"secret one\nsecret two\n", "22 bytes"),
        (b"secret\xff", "7 bytes"),
        (b"secret" * 1000, "4097 bytes"),
        (bytes(32), "only zeros"),
        (b"0" * 64, "only zeros"),
    ],
)
def test_any_other_file_is_refused_in_one_line_that_names_it_and_does_not_show_the_key(
    tmp_path: Path, content: bytes, got: str
) -> None:
    file = tmp_path / "key"
    file.write_bytes(content)
    with pytest.raises(SigningError) as caught:
        read_key(file)
    text = str(caught.value)
    assert str(file) in text
    assert "expected 32 bytes, 64 hexadecimal digits or one line" in text
    assert got in text
    assert "secret" not in text
    assert "\n" not in text


def test_a_file_that_is_not_there_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(SigningError, match=r"missing: expected .*, got No such file"):
        read_key(tmp_path / "missing")
