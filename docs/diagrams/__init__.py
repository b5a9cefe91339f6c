"""The diagrams of the pages: a short module draws one or a few that belong together, `draw` writes all of them.

A diagram takes its numbers and names from the code that it shows. `python -m docs.diagrams.draw` in the project's
folder draws all anew.
"""
