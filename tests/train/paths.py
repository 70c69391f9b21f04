"""Puts train/ on the path of a test called with BIN_DIR SOURCE_DIR; ends it with 77 if a module is absent."""
import os
import sys

BIN, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
sys.path.insert(0, os.path.join(SOURCE, 'train'))


def need(*names):
    for name in names:
        try:
            __import__(name)
        except ImportError:
            print('skipped: Python has no module', name)
            sys.exit(77)
