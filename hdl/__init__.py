"""What is synthesised: Amaranth components, each held bit for bit to its twin of the same name in `hardwall.model`."""
