"""From the encoder's pins to counts, and where the edges of its scale stand."""
