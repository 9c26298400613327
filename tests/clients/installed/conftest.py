"""Clients with environments of their own, which `make test-clients` installs: where they are."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

CLIENTS = Path(os.environ.get("CLIENTS", Path(__file__).parents[3] / "build" / "clients"))


@pytest.fixture(scope="session")
def program() -> Callable[[str, str], Path]:
    """Path of a program in the environment of a client; fails where that is not installed."""

    def find(client: str, name: str) -> Path:
        path = CLIENTS / client / "bin" / name
        assert path.exists(), f"{path} is missing: make test-clients installs it"
        return path

    return find
