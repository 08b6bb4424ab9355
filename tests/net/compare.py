"""Two folders of outputs: what differs in them, file by file and key by key."""

import csv
import json
import re
import struct
from html.parser import HTMLParser
from pathlib import Path

# What is not compared: file, key, reason. `*` stands for anything. The key must still be there, and be of the same kind.
NOT_COMPARED = [
    ("*.json", "git_hash", "the commit that the program was built from"),
    ("*.json", "version", "the program's version"),
    ("manifest.json", "files.*", "hashes of files that are compared themselves"),
    ("*.json", "build_s", "a time"),
    ("*.json", "trace_s", "a time"),
    ("*.json", "sample_s", "a time"),
    ("*.json", "write_s", "a time"),
    ("*.json", "ms_per_calibration", "a time"),
    ("times.csv", "milliseconds", "a time"),
    ("*.json", "readings_held", "how far the sensor is ahead of the disk, which depends on the machine's load"),
    ("*.json", "reason", "words"),
    ("*.json", "words", "words"),
    ("*.json", "warnings", "words"),
    ("*.json", "nulls.*", "words: why a number is null"),
    ("schema.json", "description", "words"),
    ("schema.json", "title", "words"),
    ("*.glb", "asset.generator", "the program's version"),
]
# Also not compared: the version that a recording's header names, with the offsets and sums that follow from its length;
# words in HTML and SVG (the numbers among them are); standard error; standard output that is not JSON.


def matches(pattern, text):
    return re.fullmatch(re.escape(pattern).replace(r"\*", ".*"), text) is not None


class Number(str):
    """A number of a JSON file, as its text."""


def parse_json(text):
    return json.loads(text, parse_float=Number, parse_int=Number, parse_constant=Number)


def key_matches(pattern, path):
    """Whether a pattern names a key or one that it is in; places in lists are not counted."""
    keys = re.sub(r"\[\d+\]", "", path).split(".")
    return any(
        matches(pattern, ".".join(keys[begin:end]))
        for end in range(1, len(keys) + 1)
        # Keys are named from the end, so `reason` is every key of that name.
        for begin in range(end)
    )


def is_not_compared(file, path):
    return any(matches(f, file) or matches("*/" + f, file) for f, key, _ in NOT_COMPARED if key_matches(key, path))


def compare_values(file, a, b, path=""):
    """Differences of two JSON values, as (path, what)."""
    if type(a) is not type(b):
        yield path, f"{shown(a)} → {shown(b)}"
    elif isinstance(a, dict):
        for key in sorted(a.keys() | b.keys()):
            inner = f"{path}.{key}" if path else key
            if key not in b:
                yield inner, "only in the reference"
            elif key not in a:
                yield inner, "only in the candidate"
            else:
                yield from compare_values(file, a[key], b[key], inner)
    elif isinstance(a, list):
        if len(a) != len(b):
            yield path, f"{len(a)} → {len(b)} entries"
        for number, (x, y) in enumerate(zip(a, b)):
            yield from compare_values(file, x, y, f"{path}[{number}]")
    elif a != b and not is_not_compared(file, path):
        yield path, f"{shown(a)} → {shown(b)}"


def shown(value):
    text = json.dumps(value, ensure_ascii=False) if not isinstance(value, Number) else value
    return text if len(text) <= 60 else text[:57] + "…"


def compare_json(file, a, b):
    yield from compare_values(file, parse_json(a), parse_json(b))


def compare_tables(file, a, b):
    """CSV by columns, so that one column can be meant to differ."""
    rows = [list(csv.reader(text.decode("utf-8").splitlines())) for text in (a, b)]
    heads = [table[0] if table else [] for table in rows]
    for column in heads[0] + [c for c in heads[1] if c not in heads[0]]:
        if column not in heads[1] or column not in heads[0]:
            yield column, f"only in the {'reference' if column in heads[0] else 'candidate'}"
            continue
        if is_not_compared(file, column):
            continue
        cells = [[row[head.index(column)] if len(row) > head.index(column) else None for row in table[1:]]
                 for table, head in zip(rows, heads)]
        differ = [i for i, (x, y) in enumerate(zip(*cells)) if x != y]
        if differ:
            first = differ[0]
            yield column, f"row {first + 1}: {cells[0][first]} → {cells[1][first]}, {len(differ)} rows in all"
    if len(rows[0]) != len(rows[1]):
        yield "", f"{len(rows[0])} → {len(rows[1])} rows"
    elif rows[0] == rows[1]:
        yield "", "the same cells in other bytes"


def compare_toml(file, a, b):
    """TOML by lines, each under its table's and its own key, so that one key can be meant to differ."""
    found = [{}, {}]
    for text, keys in zip((a, b), found):
        table = ""
        for line in text.decode("utf-8").splitlines():
            if line.startswith("["):
                table = line.strip("[] \t")
            name = re.match(r"([\w.\"-]+)\s*=", line)
            path = ".".join(filter(None, [table, name.group(1) if name else ""]))
            keys.setdefault(path, []).append(line)
    for path in list(found[0]) + [p for p in found[1] if p not in found[0]]:
        one, other = found[0].get(path), found[1].get(path)
        if one != other:
            if one is None or other is None:
                yield path, f"only in the {'candidate' if one is None else 'reference'}"
            else:
                pairs = [(x, y) for x, y in zip(one, other) if x != y]
                yield path, " → ".join(pairs[0]) if pairs else f"{len(one)} → {len(other)} times"
    if found[0] == found[1]:
        yield "", "the same lines in other bytes"


class Drawing(HTMLParser):
    """A page or a drawing without its words: tags, attributes and numbers."""

    WORDS = {"title", "alt", "aria-label", "content", "desc"}

    def __init__(self, text):
        super().__init__()
        self.parts, self.inside = [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.inside.append(tag)
        self.parts.append(f"<{tag}>")
        self.parts += [f"{name}={value}" for name, value in attributes if name not in self.WORDS]

    def handle_endtag(self, tag):
        while self.inside and self.inside.pop() != tag:
            pass

    def handle_data(self, text):
        if self.inside and self.inside[-1] in ("style", "script"):
            self.parts.append(text)
        else:
            self.parts += re.findall(r"\d+(?:[.,]\d+)*(?:e-?\d+)?", text)


def compare_drawings(file, a, b):
    a, b = (Drawing(text.decode("utf-8")).parts for text in (a, b))
    if len(a) != len(b):
        yield "", f"{len(a)} → {len(b)} tags, attributes and numbers"
    differ = [(x, y) for x, y in zip(a, b) if x != y]
    if differ:
        yield "", f"{shown(differ[0][0])} → {shown(differ[0][1])}, {len(differ)} in all"


MCAP_MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, CHUNK_INDEX, ATTACHMENT_INDEX, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = 1, 2, 8, 10, 13, 14, 15


def mcap_records(data):
    """The records of a recording, without the version that its header names and what follows from that one's length:
    offsets in the file and sums over it."""
    if not data.startswith(MCAP_MAGIC) or not data.endswith(MCAP_MAGIC):
        raise ValueError("not a whole recording")
    at, end = len(MCAP_MAGIC), len(data) - len(MCAP_MAGIC)
    while at < end:
        kind, length = data[at], struct.unpack_from("<Q", data, at + 1)[0]
        content = data[at + 9 : at + 9 + length]
        at += 9 + length
        if kind == HEADER:
            profile = struct.unpack_from("<I", content)[0]
            content = content[: 4 + profile]
        elif kind in (FOOTER, CHUNK_INDEX, ATTACHMENT_INDEX, METADATA_INDEX, SUMMARY_OFFSET, DATA_END):
            content = b""
        yield bytes([kind]) + content


def mcap_library(data):
    at = len(MCAP_MAGIC) + 9
    at += 4 + struct.unpack_from("<I", data, at)[0]
    length = struct.unpack_from("<I", data, at)[0]
    return data[at + 4 : at + 4 + length]


def compare_recordings(file, a, b):
    if mcap_library(a) == mcap_library(b):
        yield from compare_bytes(file, a, b)
        return
    a, b = list(mcap_records(a)), list(mcap_records(b))
    if len(a) != len(b):
        yield "", f"{len(a)} → {len(b)} records"
    for number, (x, y) in enumerate(zip(a, b)):
        if x != y:
            yield "", f"record {number}, of kind {x[0]}"
            return


def glb_parts(data):
    """The two chunks of a binary glTF: JSON and bytes."""
    length = struct.unpack_from("<I", data, 12)[0]
    return data[20 : 20 + length], data[20 + length :]


def compare_glb(file, a, b):
    (a, a_bytes), (b, b_bytes) = glb_parts(a), glb_parts(b)
    yield from compare_json(file, a, b)
    if a_bytes != b_bytes:
        yield from compare_bytes(file, a_bytes, b_bytes)


def compare_bytes(file, a, b):
    at = next((i for i, (x, y) in enumerate(zip(a, b)) if x != y), min(len(a), len(b)))
    yield "", f"{len(a)} → {len(b)} bytes, the first that differs is {at}"


COMPARE = {
    ".json": compare_json,
    ".csv": compare_tables,
    ".toml": compare_toml,
    ".html": compare_drawings,
    ".svg": compare_drawings,
    ".mcap": compare_recordings,
    ".glb": compare_glb,
}


def compare_folders(reference, candidate):
    """Differences of all that two folders hold, as (file, path in it, what); and how many files were compared."""
    files = [{str(p.relative_to(f)) for p in f.rglob("*") if p.is_file()} for f in (reference, candidate)]
    found = []
    for file in sorted(files[0] | files[1]):
        if file not in files[0] or file not in files[1]:
            found.append((file, "", f"only in the {'reference' if file in files[0] else 'candidate'}"))
            continue
        a, b = (reference / file).read_bytes(), (candidate / file).read_bytes()
        if a == b:
            continue
        try:
            compare = COMPARE.get(Path(file).suffix, compare_bytes)
            found += [(file, path, what) for path, what in compare(file, a, b)]
        except (ValueError, IndexError, struct.error) as error:
            found.append((file, "", f"cannot be read: {error}"))
    return found, len(files[0] & files[1])
