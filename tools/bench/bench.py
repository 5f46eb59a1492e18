#!/usr/bin/env python3
"""Runs the counting programs that `make bench` has built, prints a table and writes out/bench.json.

    bench.py [--json OUT] [--baseline FILE [--write-baseline]] [--opt -O2] TARGET:NUMERIC... [--peers TARGET:PEER...]

The JSON:

    TARGET                        m3 m4f m7 r5f host (x86-64)
      NUMERIC                     float fixed
        CASE                      none payload contact guard_tick: tasks of the preset `default`
                                  d_p d_e d_f d_r: with a bank of three second-order channels; d_p_one ...: one channel
          mean worst              instructions
          states rank_deficient   number of counted states, and of those with a basis of lower rank
          stages                  {STAGE: {mean, worst}}
        flash_bytes guard_bytes stack_bytes painted_stack_bytes permitted_ticks
      flash_bytes guard_bytes stack_bytes      the float's
    peers
      TARGET
        float
          CASE                    as above, of the peer with the lowest mean, whose name is `peer`
            each                  {PEER: the same}: motion_projection-level
          agreement               {PEER: {QUANTITY: {states, ppm}}}, its largest difference from ours
    about                         optimisation, system, compilers

A peer's guard_tick is our guard around the peer's computation, because no peer has frames of its own. With a baseline
each of our numbers is compared with it (baseline.py), and the exit code is 1 if one has grown.
"""

import argparse
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import images
from baseline import judge, system
from images import Counts, Peer
from table import table


def count_all(
    runs: list[tuple[str, str]], peers: list[Peer], opt: str, joints: int, jobs: int
) -> tuple[Counts, Counts]:
    """Our counts and the peers'. Several programs run at a time, because this does not change instruction counts."""
    targets = list(dict.fromkeys(peer.target for peer in peers))
    levels = list(dict.fromkeys((peer.target, peer.name[peer.name.rindex("-") :]) for peer in peers))
    with ThreadPoolExecutor(jobs) as pool:
        # The longest first. An agreement that fails ends the program before it prints anything.
        theirs = {peer: pool.submit(images.count_peer, peer) for peer in peers}
        agreed = {run: pool.submit(images.agreement, *run) for run in levels}
        ours = {run: pool.submit(images.count, *run, opt, joints) for run in runs}
        results: Counts = {}
        for (target, numeric), counts in ours.items():
            results.setdefault(target, {})[numeric] = counts.result()
        others: Counts = {}
        for target in targets:
            counted = {peer.name: counts.result() for peer, counts in theirs.items() if peer.target == target}
            agreement: Counts = {}
            for run, level in levels:
                if run == target:
                    found = agreed[run, level].result()
                    agreement.update({name + level: quantities for name, quantities in found.items()})
            others[target] = {"float": {**images.best_of(counted), "agreement": agreement}}
    for numerics in results.values():  # peers exist in float only
        shipped = numerics.get("float") or next(iter(numerics.values()))
        numerics.update({key: shipped[key] for key in images.SIZES})
    return results, others


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("images", nargs="+", metavar="TARGET:NUMERIC")
    parser.add_argument("--opt", default="-O2")
    parser.add_argument("--joints", type=int, default=7, help="number of joints for which the images are built")
    parser.add_argument("--json", type=Path)
    parser.add_argument(
        "--peers", nargs="*", default=[], metavar="TARGET:PEER", help="peer: an alternative to our core"
    )
    parser.add_argument("--baseline", type=Path)
    parser.add_argument("--write-baseline", action="store_true")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1))
    args = parser.parse_args()

    runs = [(target, numeric) for target, _, numeric in (name.partition(":") for name in args.images)]
    peers = [Peer(target, peer) for target, _, peer in (name.partition(":") for name in args.peers)]
    try:
        results, others = count_all(runs, peers, args.opt, args.joints, args.jobs)
        compilers = {target: images.compiler(target) for target in results}
    except (RuntimeError, ValueError, OSError, subprocess.SubprocessError) as error:
        print(f"bench: {error}", file=sys.stderr)
        return 1
    about = {"optimisation": args.opt, "system": system(), "compilers": compilers}
    print(table(results, others))
    if args.json:
        args.json.parent.mkdir(parents=True, exist_ok=True)
        args.json.write_text(json.dumps({**results, "peers": others, "about": about}, indent=1) + "\n")
    if args.baseline and args.write_baseline:
        args.baseline.write_text(json.dumps({**results, "about": about}, indent=1) + "\n")
    elif args.baseline:
        verdict = judge(results, compilers, json.loads(args.baseline.read_text()), system())
        for line in [*verdict.failures, *verdict.skipped]:
            print(f"bench: {line}", file=sys.stderr)
        return 1 if verdict.failures else 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
