"""The server's twin over the register file of several axes."""

from hardwall.model.axes import register_file as banked_file
from hardwall.model.link import server


class BankedServer(server.Server):
    """The twin of a server whose file is that of several axes.

    Args:
        design: the registers.
    """

    def __init__(self, design: banked_file.Design):
        self.file: banked_file.BankedFile = banked_file.BankedFile(design)
