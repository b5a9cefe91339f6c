"""The hardware: Amaranth components, every one equal bit for bit to its twin of the same name in `hardwall.model`."""
