"""`tauperp version ELF`: the firmware, build and configuration of an image."""

import argparse
import dataclasses
import json

from tauperp.image import PRODUCT, read_image

HELP = """Print the identity of a firmware image: release, build of the sources (its first four digits are BuildId of
GuardStatus), CRCs of its configuration and wire, board, number type, and variant."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("elf", metavar="ELF", help="image as `make firmware` builds it")
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")


def run(args: argparse.Namespace) -> int:
    image = read_image(args.elf)
    if args.json:
        print(json.dumps(dataclasses.asdict(image), indent=2))
        return 0
    only = "" if image.variant == PRODUCT else f", variant {image.variant}: not for a robot"
    print(f"tauperp {image.version} for {image.board}, {image.numeric}{only}")
    print(f"build {image.build}, configuration {image.config_crc}, wire {image.wire_crc}")
    print(f"image {image.image or 'without a build id'}")
    return 0
