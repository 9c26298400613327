"""Serial control: a console over SERIAL_CONTROL, as ground stations offer it for PX4's.

https://mavlink.io/en/messages/common.html#SERIAL_CONTROL. Only the shell is there, none of the ports. It echoes what
comes and prompts like the NuttX shell, for that is what consoles are made for; `sitl.mavlink.shell` has the commands.
Each sender has a line and an output of his own.
"""

from collections.abc import Mapping
from typing import Any

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.service import Exchange, Handler, Sender, Service
from sitl.mavlink.shell import Shell

__all__ = ["SerialControlService"]

PROMPT = "nsh> "
PIECE = 70  # bytes of text in one message
LONGEST_LINE = 200  # characters
MOST_OUTPUT = 1 << 16  # bytes that wait for whoever does not fetch them
MOST_CONSOLES = 8
BURST = 32  # messages before others get their turn
PAUSE = 0.005  # between bursts [s], wall time
FULL_PAUSE = 0.05  # when the socket takes no more

RETURN, NEWLINE, CONTROL_C = "\r", "\n", "\x03"
ERASE = ("\b", "\x7f")


class SerialControlService(Service):
    """SERIAL_CONTROL of the shell."""

    def __init__(self, exchange: Exchange) -> None:
        """Serve through `exchange`."""
        super().__init__(exchange)
        self._shell = Shell(exchange)
        self._consoles: dict[tuple[int, int], _Console] = {}

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {"SERIAL_CONTROL": self._on_serial_control}

    def _on_serial_control(self, message: Any, sender: Sender) -> None:
        if message.device != mav.SERIAL_CONTROL_DEV_SHELL or message.flags & mav.SERIAL_CONTROL_FLAG_REPLY:
            return
        key = (sender.system, sender.component)
        console = self._consoles.pop(key, None) or _Console(self._shell)
        self._consoles[key] = console  # the last of them is the latest heard
        if len(self._consoles) > MOST_CONSOLES:
            del self._consoles[next(iter(self._consoles))]
        console.sender = sender
        console.type(bytes(message.data[: message.count]))
        # What nobody wants to hear now may be fetched later.
        if message.flags & mav.SERIAL_CONTROL_FLAG_RESPOND and not console.is_sending:
            self._send(console)

    def _send(self, console: "_Console") -> None:
        """Send what there is to say, in bursts."""
        console.is_sending = False
        pause = PAUSE
        for _ in range(BURST):
            piece = bytes(console.output[:PIECE])
            if not piece or console.sender is None:
                return
            taken = self.exchange.reply(
                console.sender,
                "SERIAL_CONTROL",
                device=mav.SERIAL_CONTROL_DEV_SHELL,
                flags=mav.SERIAL_CONTROL_FLAG_REPLY,
                count=len(piece),
                data=piece,
            )
            if not taken:
                pause = FULL_PAUSE
                break
            del console.output[: len(piece)]
        console.is_sending = True
        self.exchange.after(pause, lambda: self._send(console))


class _Console:
    """One sender's line and output.

    Attributes:
        sender: where he was heard last.
        output: what he has not been sent yet; ASCII, so that it can be cut anywhere.
        is_sending: more is sent a little later.
    """

    def __init__(self, shell: Shell) -> None:
        self.sender: Sender | None = None
        self.output = bytearray()
        self.is_sending = False
        self._shell = shell
        self._line = ""
        self._previous = ""
        self._say(PROMPT)

    def type(self, data: bytes) -> None:
        """Take what was typed; each full line is carried out."""
        for character in data.decode("ascii", errors="replace"):
            if character in (RETURN, NEWLINE):
                if not (character == NEWLINE and self._previous == RETURN):  # both together end one line
                    self._enter()
            elif character == CONTROL_C:
                self._line = ""
                self._say(f"\n{PROMPT}")
            elif character in ERASE:
                if self._line:
                    self._line = self._line[:-1]
                    self._say("\b \b")
            elif character.isprintable() and len(self._line) <= LONGEST_LINE:
                self._line += character
                self._say(character)
            self._previous = character

    def _enter(self) -> None:
        line, self._line = self._line, ""
        self._say("\n")
        if len(line) > LONGEST_LINE:
            self._say(f"line: expected at most {LONGEST_LINE} characters\n")
        else:
            self._say(self._shell.run(line))
        self._say(PROMPT)

    def _say(self, text: str) -> None:
        self.output += text.encode("ascii", errors="replace")[: MOST_OUTPUT - len(self.output)]
