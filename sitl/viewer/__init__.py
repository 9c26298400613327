"""Watching the flight in Rerun: `open_viewer` starts it, `Viewer.offer` feeds it."""

import socket
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote, urlsplit

from sitl.viewer.geometry import airframe
from sitl.viewer.handle import Viewer

if TYPE_CHECKING:
    from vehicle_model.aircraft import Aircraft

__all__ = ["Viewer", "ViewerOptionError", "open_viewer"]

GRPC_PORT = 9876  # Rerun's own defaults; the next free ones when they are taken
WEB_PORT = 9090


class ViewerOptionError(ValueError):
    """The viewer option names nothing that can be opened; the message says what was expected."""


def open_viewer(option: str, aircraft: "Aircraft", *, name: str = "tiltwing", map: bool = True) -> Viewer:  # noqa: A002
    """Start the viewer process and return the flight's end of it; returns at once, the viewer follows in a second.

    Args:
        option: `web` serves a web viewer on loopback, `spawn` opens Rerun's window, `connect:URL` sends to a running
            viewer, `save:FILE.rrd` records, `off` does nothing.
        aircraft: drawn from its geometry.
        name: name of the recording in the viewer.
        map: show the map view, which fetches tiles from the internet.

    Raises ViewerOptionError for any other option, a URL that is no Rerun address or a file that cannot be written.
    """
    kind, _, value = option.partition(":")
    if option == "off":
        return Viewer()
    setup = {"kind": kind, "name": name, "map": map, "airframe": airframe(aircraft)}
    if option == "web":
        grpc_port = _free_port(GRPC_PORT)
        web_port = _free_port(WEB_PORT)
        url = quote(f"rerun+http://127.0.0.1:{grpc_port}/proxy", safe="")
        address = f"http://127.0.0.1:{web_port}/?url={url}"
        setup |= {"grpc_port": grpc_port, "web_port": web_port}
    elif option == "spawn":
        address = "Rerun's window"
        setup |= {"grpc_port": GRPC_PORT}
    elif kind == "connect":
        address = value
        setup |= {"url": _checked_url(value)}
    elif kind == "save":
        address = value
        setup |= {"file": _checked_file(value)}
    else:
        msg = f"viewer {option!r}: expected web, spawn, connect:URL, save:FILE.rrd or off"
        raise ViewerOptionError(msg)
    return Viewer(address, setup)


def _checked_url(url: str) -> str:
    parts = urlsplit(url)
    try:
        good = parts.scheme in ("rerun+http", "rerun+https") and bool(parts.hostname) and parts.path == "/proxy"
        good = good and parts.port is not None
    except ValueError:  # a port that is no number
        good = False
    if not good:
        msg = f"viewer connect:{url}: expected connect:rerun+http://HOST:PORT/proxy"
        raise ViewerOptionError(msg)
    return url


def _checked_file(file: str) -> str:
    path = Path(file).absolute()
    problem = ""
    if path.suffix != ".rrd":
        problem = "expected a file name that ends in .rrd"
    elif not path.parent.is_dir():
        problem = f"expected the folder {path.parent} to exist"
    else:
        try:
            path.open("ab").close()
        except OSError as error:
            problem = f"expected a file that can be written: {error.strerror}"
    if problem:
        msg = f"viewer save:{file}: {problem}"
        raise ViewerOptionError(msg)
    return str(path)


def _free_port(first: int) -> int:
    """First port from `first` on that can be bound on loopback."""
    for port in range(first, first + 100):
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    msg = f"viewer web: expected a free port on 127.0.0.1 between {first} and {first + 99}"
    raise ViewerOptionError(msg)
