"""The last collision and the blind links, as text."""

from tauperp.monitor.snapshot import Snapshot, spoken

LINKS = 8


def contact_words(snapshot: Snapshot) -> str:
    """Link, force and class of the last collision; empty before the first one."""
    kind, link, force = (snapshot.live(f"Contact{name}") for name in ("Class", "Link", "Force"))
    if kind in (None, "Unknown") or link is None or force is None:
        return ""
    where = f"link {link:.0f}, {force:.0f} N" if link else "link unknown"
    return f"{spoken(str(kind))}, {where}"


def blind_words(snapshot: Snapshot) -> str:
    """The links on which the index in force detects no force. A mark (!) follows those that the task must protect."""
    blind, needed = (_links(snapshot, name) for name in ("BlindLinks", "NeededLinks"))
    if not blind:
        return ""
    return "blind to link " + " ".join(f"{link}{'!' if link in needed else ''}" for link in blind)


def _links(snapshot: Snapshot, name: str) -> list[int]:
    bits = snapshot.live(name)
    return [] if bits is None else [link + 1 for link in range(LINKS) if int(bits) >> link & 1]
