"""Message signing: who may speak to the vehicle, and proof that it is the vehicle that speaks.

https://mavlink.io/en/guide/message_signing.html. One `Signing` serves all links, so that what was heard on one cannot
be played back on another. Timestamps count 10 us since 2015 by the wall clock; they never go back, and a correctly
signed frame that is ahead takes ours along. `SigningService` serves SETUP_SIGNING.
"""

import hashlib
import time
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from hmac import compare_digest
from typing import Annotated, Any, Final, NamedTuple

import msgspec
from fastcrc.crc16 import mcrf4xx

from sitl.flight.refused import Refused
from sitl.mavlink.codec import MAGIC_V2
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.service import Exchange, Handler, Sender, Service
from sitl.mavlink.signing_key import KEY_SIZE, SigningError
from sitl.mavlink.state_folder import StateError, StateFolder

__all__ = ["SIGNATURE_SIZE", "SIGNED", "Signing", "SigningService", "Verdict", "for_log"]

SIGNED: Final = 0x01  # the incompatibility flag, third byte of a frame, of one that ends with a signature
SIGNATURE_SIZE: Final = 13  # [bytes]: link id, timestamp, and the first 48 bits of a SHA-256
_HASH_SIZE = 6

UNIX_2015 = 1420070400  # [s]
TICKS = 100_000  # of a timestamp in a second
LATEST = (1 << 48) - 1  # timestamp there is, in the year 2104
STALE = 60 * TICKS  # behind our own timestamp: not accepted any more
# How far ahead of ours an initial timestamp may be: a clock more wrong than that would lock out everybody else's.
FARTHEST_START = 366 * 86400 * TICKS
SAVE_PERIOD = 10.0  # [s], wall time
MARGIN = 15 * TICKS  # by which the stored timestamp is ahead of ours: it holds until the next one is stored
MOST_STREAMS = 1024  # whose latest timestamps are kept
STORED_AS = "signing"  # in the state folder

OPEN, VALID, EXEMPT, TRUSTED = "open", "valid", "exempt", "trusted"
UNSIGNED, FORGED, REPLAYED, STALE_FRAME = "unsigned", "forged", "replayed", "stale"


class Verdict(NamedTuple):
    """What becomes of a frame, and why.

    Accepted: `open` (there is no key), `valid`, `exempt` (RADIO_STATUS: radios have no key), `trusted` (unsigned, on a
    trusted link). Not accepted: `unsigned`, `forged`, `replayed`, `stale` (more than a minute behind).
    """

    accepted: bool
    reason: str


_VERDICTS = {reason: Verdict(True, reason) for reason in (OPEN, VALID, EXEMPT, TRUSTED)} | {
    reason: Verdict(False, reason) for reason in (UNSIGNED, FORGED, REPLAYED, STALE_FRAME)
}


class _Stored(msgspec.Struct, forbid_unknown_fields=True):
    """What the file holds; the key in base64."""

    key: Annotated[bytes, msgspec.Meta(min_length=KEY_SIZE, max_length=KEY_SIZE)] | None
    timestamp: Annotated[int, msgspec.Meta(ge=0, le=LATEST)]


class Signing:
    """The vehicle's key, its timestamp, and those of all streams heard.

    Attributes:
        counts: frames judged, by the reason of their verdict.
    """

    def __init__(
        self, state: StateFolder | None = None, key: bytes | None = None, *, clock: Callable[[], float] = time.time
    ) -> None:
        """Begin with a stored key and timestamp.

        Args:
            state: where they are kept; None: nowhere.
            key: of 32 bytes, goes before a stored one.
            clock: UTC [s since 1970].

        Raises StateError for a file that cannot be read, SigningError for one that holds something else.
        """
        self.counts: Counter[str] = Counter()
        self._state = state
        self._clock = clock
        self._streams: dict[tuple[int, int, int], int] = {}  # latest timestamp by system, component and link id
        stored = _Stored(None, 0) if state is None else _stored(state)
        self._key = stored.key
        self._timestamp = stored.timestamp
        self._heard_with = stored.key  # the key that the streams' frames were signed with
        if key is not None:
            self.set_key(key)

    @property
    def is_on(self) -> bool:
        """Whether there is a key: frames sent must be signed."""
        return self._key is not None

    @property
    def timestamp(self) -> int:
        """Ours now: that of the clock, unless it was already later."""
        return max(self._timestamp, min(int((self._clock() - UNIX_2015) * TICKS), LATEST))

    def set_key(self, key: bytes | None, initial_timestamp: int = 0) -> None:
        """Sign and verify with a key of 32 bytes from now on; None: neither.

        A timestamp earlier than ours changes nothing. Raises ValueError, and then changes nothing, for a key that is
        none and for a timestamp more than a year ahead of ours.
        """
        if key is not None and (len(key) != KEY_SIZE or not any(key)):
            msg = f"signing key: expected {KEY_SIZE} bytes that are not all zero"
            raise ValueError(msg)
        now = self.timestamp
        if initial_timestamp > now + FARTHEST_START:
            days = (initial_timestamp - now) // (86400 * TICKS)
            msg = f"signing timestamp: expected one up to a year ahead of our clock, got {days} days"
            raise ValueError(msg)
        self._timestamp = max(self._timestamp, initial_timestamp)
        if key is not None and key != self._heard_with:
            self._streams.clear()
            self._heard_with = key
        self._key = key

    def sign(self, frame: bytes, link_id: int) -> bytes:
        """A MAVLink 2 frame with its signature.

        `frame` is complete but for it: the flag SIGNED is set, for the checksum covers it. Without a key the frame
        comes back as it is. A link id is a number 0 to 255 that only this link has.
        """
        key = self._key
        if key is None:
            return frame
        # Each frame has a later timestamp than the one before, also where the clock stands or jumps back.
        ticks = int((self._clock() - UNIX_2015) * TICKS)
        timestamp = self._timestamp + 1
        self._timestamp = timestamp = min(max(ticks, timestamp), LATEST)
        body = frame + bytes((link_id,)) + timestamp.to_bytes(6, "little")
        return body + hashlib.sha256(key + body).digest()[:_HASH_SIZE]

    def verdict(self, raw: bytes, system: int, component: int, message_id: int, *, trusted: bool) -> Verdict:
        """Whether a frame, whole and with a correct checksum, is to be believed.

        `trusted`: it came on a link that takes unsigned frames too. Only a valid frame advances any timestamp.
        """
        if self._key is None:
            reason = OPEN
        elif message_id == mav.MAVLINK_MSG_ID_RADIO_STATUS:
            reason = EXEMPT
        elif raw[0] != MAGIC_V2 or not raw[2] & SIGNED:
            reason = TRUSTED if trusted else UNSIGNED
        elif not compare_digest(hashlib.sha256(self._key + raw[:-_HASH_SIZE]).digest()[:_HASH_SIZE], raw[-_HASH_SIZE:]):
            reason = FORGED
        else:
            stream = (system, component, raw[-SIGNATURE_SIZE])
            reason = self._in_time(stream, int.from_bytes(raw[-SIGNATURE_SIZE + 1 : -_HASH_SIZE], "little"))
        self.counts[reason] += 1
        return _VERDICTS[reason]

    def save(self) -> None:
        """Store key and timestamp, ahead of ours by what may be used until the next time; raises StateError."""
        self._store(min(self.timestamp + MARGIN, LATEST))

    def close(self) -> None:
        """Store key and timestamp as they are, for nothing more will be signed; raises StateError."""
        self._store(self._timestamp)

    def _in_time(self, stream: tuple[int, int, int], timestamp: int) -> str:
        """The reason for accepting or refusing a correctly signed frame by its timestamp."""
        if timestamp <= self._streams.get(stream, -1):
            return REPLAYED
        now = self.timestamp
        if timestamp + STALE < now:
            return STALE_FRAME
        if stream not in self._streams and len(self._streams) >= MOST_STREAMS:
            # Those silent for a minute need not be remembered: what was heard of them is stale by now.
            self._streams = {known: latest for known, latest in self._streams.items() if latest + STALE >= now}
            if len(self._streams) >= MOST_STREAMS:
                return REPLAYED  # for all that can be known
        self._streams[stream] = timestamp
        self._timestamp = max(now, timestamp)
        return VALID

    def _store(self, timestamp: int) -> None:
        if self._state is not None:
            self._state.write(STORED_AS, msgspec.json.encode(_Stored(self._key, timestamp)))


def _stored(state: StateFolder) -> _Stored:
    """What a folder holds. Raises StateError and SigningError: to begin without the key would let everybody in."""
    content = state.read(STORED_AS)
    if content is None:
        return _Stored(None, 0)
    try:
        return msgspec.json.decode(content, type=_Stored)
    except msgspec.DecodeError as error:
        msg = f"{state.folder}/{STORED_AS}: expected a stored key and timestamp, got {error}; remove it to begin anew"
        raise SigningError(msg) from None


def for_log(raw: bytes, message_id: int) -> bytes | None:
    """A whole frame as a log may keep it: without signature, so that logs are no help in guessing the key.

    None for a frame that must not be kept, for it tells the key, or that cannot be changed, for its message is unknown.
    """
    if message_id == mav.MAVLINK_MSG_ID_SETUP_SIGNING:
        return None
    if raw[0] != MAGIC_V2 or not raw[2] & SIGNED:
        return raw
    message = mav.mavlink_map.get(message_id)
    if message is None:
        return None
    body = raw[1:2] + bytes((raw[2] & ~SIGNED,)) + raw[3 : -SIGNATURE_SIZE - 2]
    return raw[:1] + body + mcrf4xx(body + bytes((message.crc_extra,))).to_bytes(2, "little")


class SigningService(Service):
    """SETUP_SIGNING: takes a new key, or none, and keeps it.

    Who may say so needs no check here: while there is a key, only what it has signed, or came on a trusted link,
    arrives at all.
    """

    def __init__(self, exchange: Exchange, signing: Signing) -> None:
        """Serve through `exchange`, for the one `signing` of all links."""
        super().__init__(exchange)
        self._signing = signing
        self._disk = ThreadPoolExecutor(1, "signing")  # may be slow, and the flight must not wait
        self._storing: Future[None] | None = None
        self._is_stored = True  # as far as is known
        self._keep()

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {"SETUP_SIGNING": self._on_setup_signing}

    def close(self) -> None:
        """See Service."""
        if self._storing is not None:
            self._storing = self._disk.submit(self._signing.close)
            self._report()
        self._disk.shutdown()

    def _on_setup_signing(self, message: Any, sender: Sender) -> None:
        if self._is_armed():
            self.exchange.tell(sender, mav.MAV_SEVERITY_ERROR, "Signing not changed: only while disarmed")
            return
        key = bytes(message.secret_key)
        try:
            self._signing.set_key(key if any(key) else None, message.initial_timestamp)
        except ValueError as error:
            self.exchange.tell(sender, mav.MAV_SEVERITY_ERROR, f"Signing not changed: {error}")
            return
        state = "on" if self._signing.is_on else "off"
        self.exchange.statustext(mav.MAV_SEVERITY_NOTICE, f"Message signing {state}")
        self._storing = self._disk.submit(self._signing.save)
        self._report()

    def _is_armed(self) -> bool:
        simulation = self.exchange.simulation
        try:
            return simulation.flight.armed
        except Refused:  # there is no flight controller to be armed
            return not simulation.snapshot().on_ground

    def _keep(self) -> None:
        """Store the timestamp, now and every SAVE_PERIOD."""
        if self._storing is None or self._storing.done():
            self._report()
            self._storing = self._disk.submit(self._signing.save) if self._signing.is_on else None
        self.exchange.after(SAVE_PERIOD, self._keep)

    def _report(self) -> None:
        """Wait for what is being stored, and say once if it cannot be."""
        error = None if self._storing is None else self._storing.exception()
        if isinstance(error, StateError) and self._is_stored:
            self.exchange.statustext(mav.MAV_SEVERITY_WARNING, f"Signing key not stored: {error}")
        self._is_stored = error is None
