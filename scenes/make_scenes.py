#!/usr/bin/python3
"""Writes cornell/ and room/ next to this file, the same bytes each time. Standard library only."""

import os

import cornell
import room

if __name__ == "__main__":
    here = os.path.dirname(os.path.abspath(__file__))
    cornell.make(os.path.join(here, "cornell"))
    room.make(os.path.join(here, "room"))
