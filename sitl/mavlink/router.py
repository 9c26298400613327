"""Routing: who has been heard on which link, and where a frame goes on to.

https://mavlink.io/en/guide/routing.html. A frame for everybody, or without a target, goes to all other peers; one for
a system, or one of its components, only to where these have been heard. Nothing goes back to where it came from.
"""

from typing import TYPE_CHECKING

from sitl.mavlink.codec import codec, codec_by_id
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.frames import Frame
from sitl.mavlink.links import Link, Peer

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["Router", "targets_of"]

# Between two ends of one link: a key must not travel on, and a radio reports on its own link.
NOT_FORWARDED = frozenset({mav.MAVLINK_MSG_ID_SETUP_SIGNING, codec("RADIO_STATUS").id})
QUIET = "highlatency"  # stream set of links that only carry what is meant for those heard there
MOST_ROUTES = 512


def targets_of(frame: Frame) -> tuple[int, int]:
    """System and component that a frame is meant for, 0 for everybody."""
    if not frame.is_known:
        return 0, 0  # where the target of an unknown message stands nobody knows
    packer = codec_by_id(frame.message)
    return packer.targets(frame.payload) if packer.has_target else (0, 0)


class Router:
    """Learns where systems are and passes their frames on."""

    def __init__(self, links: "Iterable[Link]") -> None:
        """Route between these links."""
        self._links = tuple(links)
        self._routes: dict[tuple[int, int], dict[Peer, Link]] = {}

    def learn(self, frame: Frame, link: Link, peer: Peer) -> None:
        """The sender of a frame is at this peer."""
        heard = (frame.system, frame.component)
        peers = self._routes.get(heard)
        if peers is None:
            if len(self._routes) >= MOST_ROUTES:
                del self._routes[next(iter(self._routes))]
            self._routes[heard] = {peer: link}
        elif peer not in peers:
            peers[peer] = link

    def forget(self) -> None:
        """Forget peers that are not there any more."""
        present = {peer for link in self._links for peer in link.peers}
        for heard, peers in list(self._routes.items()):
            for peer in [peer for peer in peers if peer not in present]:
                del peers[peer]
            if not peers:
                del self._routes[heard]

    def forward(self, frame: Frame, target: tuple[int, int], source: Peer) -> None:
        """Pass a frame on that is not, or not only, meant for us."""
        if frame.message in NOT_FORWARDED:
            return
        system, component = target
        if system == 0:
            for link in self._links:
                if link.spec.streams != QUIET:
                    for peer in link.audience:
                        if peer is not source:
                            link.forward(peer, frame.raw)
            return
        reached: set[Peer] = {source}
        for (heard_system, heard_component), peers in self._routes.items():
            if heard_system == system and component in (0, heard_component):
                for peer, link in peers.items():
                    if peer not in reached:
                        reached.add(peer)
                        link.forward(peer, frame.raw)
