"""Pins and clocks of boards, a file a board; a package only so that an installation has them too."""
