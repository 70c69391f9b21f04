#!/usr/bin/python3
"""Writes cornell/, rare_light/, room/ and failure/*/ next to this file, the same bytes each time. Standard library only."""

import os

import cornell
import rare_light
import room
from failure import broken, caustic, fine, lights, units

if __name__ == "__main__":
    here = os.path.dirname(os.path.abspath(__file__))
    cornell.make(os.path.join(here, "cornell"))
    rare_light.make(os.path.join(here, "rare_light"))
    room.make(os.path.join(here, "room"))
    for family in (broken, caustic, fine, lights, units):
        family.make(os.path.join(here, "failure", family.__name__.split(".")[-1]))
