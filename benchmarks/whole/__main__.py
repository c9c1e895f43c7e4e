"""How long does the whole take, beside an earlier commit and beside peers? Clock, processor time and memory in one run.

    python -m benchmarks.whole [--before COMMIT] [--repeats N] [--only WORD ...] [--keep] [--smoke]

The first table runs each piece of work in a process of its own, in turn with this tree and with the commit, so that
what else the machine does falls on both; the least of the repeats counts. The commit is laid out in a folder that is
removed at the end, and what is compiled there is kept as long. Large parts are made beside it: a sphere of 1.3 million
faces, and a cap 30 mm in radius. Processor time is that of the process with all that it starts; memory is its peak, or
that of the largest it starts, and of inner work what it takes above its input. 'first run' compiles every kernel anew.

The second table is of peers that are installed (potpourri3d, libigl, scipy's distance transform with contourpy, toppra,
pinocchio), at rising sizes, with the exponents with which the times grow; those that are missing are named
(compas_slicer demands numpy 1.23 or older). `--keep` writes it to `benchmarks/whole/figures.csv`, of which
`python -m benchmarks.guide --draw speed.png` draws the picture. A new row is a line of WORKS or of PEERS
(`benchmarks/whole/works.py`). Memory is read as Linux tells it.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.code_base import extract_commit
from benchmarks.parts.tables import row, script_parser, table
from benchmarks.whole.costs import TREE, Cost, cost_of, costs_of, least
from benchmarks.whole.figures import Pair, save
from benchmarks.whole.works import PEERS, WORKS, Peer, Work, inner

# The commit before the chain was made faster.
BEFORE = "356c82c"
REPEATS = 3


def main() -> None:
    """Print both tables."""
    parser = script_parser(__doc__, smoke="the smallest work, this tree beside itself")
    parser.add_argument("--before", default=BEFORE, metavar="COMMIT", help="to stand beside")
    parser.add_argument("--repeats", type=int, default=REPEATS, help="of each piece of work")
    parser.add_argument("--only", nargs="+", default=(), metavar="WORD", help="rows whose name has one of the words")
    parser.add_argument("--keep", action="store_true", help="write the second table's figures alone")
    arguments = parser.parse_args()
    if arguments.keep and (arguments.only or arguments.smoke):
        parser.error("--keep writes what everybody can make again: without --only and --smoke")
    repeats = 1 if arguments.smoke else arguments.repeats
    works = [work for work in WORKS if _asked(work.name, arguments.only)]
    peers = [peer for peer in PEERS if _asked(peer.name, arguments.only)]
    if not arguments.keep:
        with TemporaryDirectory() as folder:
            before = TREE if arguments.smoke else Path(folder)
            if before != TREE:
                extract_commit(arguments.before, before)
            for line in whole(works, before, repeats=repeats, smoke=arguments.smoke):
                print(line, flush=True)
    found: list[Pair] = []
    for line in beside(peers, found, repeats=repeats, smoke=arguments.smoke):
        print(line, flush=True)
    if arguments.keep:
        save(found)


def _asked(name: str, words: Sequence[str]) -> bool:
    return not words or any(word in name for word in words)


def whole(works: Sequence[Work], before: Path, *, repeats: int, smoke: bool) -> Iterator[str]:
    """Yield the table of this tree beside another."""
    heads = [f"{what} {when}" for what in ("clock, s:", "processor, s:", "memory, MB:") for when in ("before", "now")]
    yield from table("work", *heads, "clock now / before", "processor now / before")
    for work in works:
        if smoke and not work.small:
            continue
        arguments = work.small if smoke else work.arguments
        if not (work.fresh or smoke):
            for tree in (before, TREE):
                cost_of(arguments, tree)  # Compiles.
        pairs = [[cost_of(arguments, tree, fresh=work.fresh) for tree in (before, TREE)] for _ in range(repeats)]
        then, now = (least([pair[index] for pair in pairs]) for index in (0, 1))
        cells = [f"{value:.2f}" for value in (then.clock, now.clock, then.processor, now.processor)]
        cells += [f"{value:.0f}" for value in (then.memory, now.memory)]
        yield row(work.name, *cells, f"{now.clock / then.clock:.2f}", f"{now.processor / then.processor:.2f}")


def beside(peers: Sequence[Peer], found: list[Pair], *, repeats: int, smoke: bool) -> Iterator[str]:
    """Yield the table of this tree beside peers, and add to what was found."""
    yield from table("work", "size", "geoprint, s", "peer", "s", "geoprint / peer", "geoprint, MB", "peer, MB")
    present = [
        peer
        for peer in peers
        if all(importlib.util.find_spec(library) is not None for library in peer.library.split(" + "))
    ]
    smallest = iter(_smallest(present) if smoke else [])
    for peer in peers:
        if peer not in present:
            yield row(peer.name, "-", "-", f"{peer.library} is not installed", *["-"] * 4)
            continue
        pairs: list[Pair] = []
        for size in peer.sizes[:1] if smoke else peer.sizes:
            pairs.append(next(smallest) if smoke else _measured(peer, size, repeats=repeats))
            yield _line(pairs[-1])
        found += pairs
        if len(pairs) > 1:
            times = np.log([[pair.own, pair.other] for pair in pairs])
            own, other = np.polyfit(np.log([pair.size for pair in pairs]), times, 1)[0].tolist()
            yield row(peer.name, "exponent", f"{own:.2f}", peer.library, f"{other:.2f}", *[""] * 3)


def _measured(peer: Peer, size: int, *, repeats: int) -> Pair:
    own, other = (least([cost_of(inner(code, size), TREE) for _ in range(repeats)]) for code in (peer.own, peer.code))
    return _pair(peer, size, own, other)


def _smallest(peers: Sequence[Peer]) -> list[Pair]:
    """Return what all peers take at their smallest sizes, once and in a single process."""
    codes = [inner(code, peer.sizes[0])[1] for peer in peers for code in (peer.own, peer.code)]
    costs = costs_of(codes, TREE)
    pairs = zip(costs[::2], costs[1::2], strict=True)
    return [_pair(peer, peer.sizes[0], *pair) for peer, pair in zip(peers, pairs, strict=True)]


def _pair(peer: Peer, size: int, own: Cost, other: Cost) -> Pair:
    return Pair(peer.name, peer.library, size, own.clock, other.clock, own.memory, other.memory)


def _line(pair: Pair) -> str:
    seconds = f"{pair.own:.3f}", pair.library, f"{pair.other:.3f}", f"{pair.own / pair.other:.2f}"
    return row(pair.work, str(pair.size), *seconds, f"{pair.own_memory:.0f}", f"{pair.other_memory:.0f}")


if __name__ == "__main__":
    main()
