"""Differences that are meant: `--except`, and the lines of tests/same_bytes.changes."""

from net.compare import key_matches, matches


class CannotTry(Exception):
    """What is needed for a comparison is missing."""


class Meant:
    """A difference that is meant: scene, file and key, where `*` stands for anything."""

    def __init__(self, text):
        parts = text.split(":", 2)
        if len(parts) < 2:
            raise CannotTry(f"{text!r} is not SCENE:FILE or SCENE:FILE:KEY")
        self.text, self.used = text, False
        self.scene, self.file = parts[0], parts[1]
        self.key = parts[2] if len(parts) == 3 else None

    def covers(self, scene, file, path):
        covered = (
            matches(self.scene, scene)
            and (matches(self.file, file) or matches("*/" + self.file, file))
            and (self.key is None or key_matches(self.key, path))
        )
        self.used |= covered
        return covered


def lines_of_changes(text):
    """The lines of tests/same_bytes.changes that say something; each ends with its reason after `#`."""
    found = []
    for line in text.splitlines():
        if line.strip() and not line.startswith("#"):
            what, _, reason = line.partition("#")
            if not reason.strip():
                raise CannotTry(f"tests/same_bytes.changes: no reason after # in {line!r}")
            found.append(what.strip())
    return found
