"""Rerun's web viewer on loopback, kept from calling home.

Rerun's own web server binds every interface, and the page it serves reports usage without a way to opt out. So its
files are taken from the installed Rerun once and served from memory, with a Content-Security-Policy that lets the
page reach the flight's data (and map tiles, when the map is shown) and nothing else.
"""

import contextlib
import socket
import subprocess
import time
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from urllib.error import URLError
from urllib.parse import urlsplit
from urllib.request import ProxyHandler, build_opener

from rerun_cli import __file__ as rerun_cli_file

__all__ = ["rerun_binary", "serve_web_viewer", "unused_port"]

FILES = ("/", "/favicon.ico", "/apple-touch-icon.png", "/sw.js", "/re_viewer.js", "/re_viewer_bg.wasm")
OWN_PAGE = "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:"  # as Rerun's page is written
TILE_SERVERS = "https://*.openstreetmap.org"  # of the layout's map
START_DEADLINE = 20.0  # s of wall time for Rerun's own server to come up


def rerun_binary() -> str:
    """Path of the Rerun viewer that came with the SDK; the `rerun` command is only a wrapper that outlives signals."""
    folder = Path(rerun_cli_file).parent
    for candidate in ("rerun", "rerun.exe", "Rerun.app/Contents/MacOS/Rerun"):
        if (folder / candidate).is_file():
            return str(folder / candidate)
    msg = f"no Rerun viewer in {folder}: expected the one installed with rerun-sdk"
    raise FileNotFoundError(msg)


def serve_web_viewer(port: int, grpc_port: int, *, show_map: bool) -> None:
    """Serve the web viewer on 127.0.0.1:`port` from a background thread; it may talk to `grpc_port` there.

    Raises OSError when the port is taken or Rerun's own server does not come up.
    """
    policy = f"{OWN_PAGE}; connect-src 'self' http://127.0.0.1:{grpc_port} http://localhost:{grpc_port}"
    if show_map:
        policy += f" {TILE_SERVERS}"
    files = _rerun_files()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            found = files.get(urlsplit(self.path).path)
            if found is None:
                self.send_error(HTTPStatus.NOT_FOUND)
                return
            kind, content = found
            self.send_response(HTTPStatus.OK)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            self.send_header("rerun-final-length", str(len(content)))
            self.send_header("Content-Security-Policy", policy)
            self.end_headers()
            with contextlib.suppress(ConnectionError):  # a browser tab closed while loading
                self.wfile.write(content)

        def log_message(self, format: str, *args: object) -> None:  # noqa: A002
            """Stay quiet: the terminal belongs to the flight."""

    server = ThreadingHTTPServer(("127.0.0.1", port), Handler)
    server.daemon_threads = True
    Thread(target=server.serve_forever, name="web viewer", daemon=True).start()


def _rerun_files() -> dict[str, tuple[str, bytes]]:
    """Path -> (content type, content) of what makes up the web viewer, from a short-lived server of Rerun's."""
    web_port, grpc_port = unused_port(), unused_port()
    command = [rerun_binary(), "--serve-web", "--bind", "127.0.0.1"]
    command += ["--port", str(grpc_port), "--web-viewer-port", str(web_port)]
    server = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    opener = build_opener(ProxyHandler({}))  # loopback: no proxy of the user's may be in between
    try:
        end = time.monotonic() + START_DEADLINE
        while True:
            try:
                opener.open(f"http://127.0.0.1:{web_port}/", timeout=5.0).close()
                break
            except (URLError, ConnectionError):
                if server.poll() is not None or time.monotonic() > end:
                    msg = f"{command[0]} --serve-web did not start"
                    raise OSError(msg) from None
                time.sleep(0.05)
        files = {}
        for path in FILES:
            with opener.open(f"http://127.0.0.1:{web_port}{path}", timeout=20.0) as answer:
                files[path] = (answer.headers["Content-Type"], answer.read())
        return files
    finally:
        server.kill()
        server.wait()


def unused_port() -> int:
    """A port that nothing on loopback listened on just now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
