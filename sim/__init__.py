"""The world around the axis: scenes, plant, encoder, the closed loop and the command line."""
