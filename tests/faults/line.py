"""A line between the program and the service that tests watch and break: bytes pass, whatever they say."""
import socket
import threading


class Line:
    """Each connection is joined with one to the service by `join(client, server)`, which does not wait."""

    def __init__(self, port):
        self.port = port
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.url = "http://127.0.0.1:%d" % self.listener.getsockname()[1]
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            client, _ = self.listener.accept()
            self.join(client, socket.create_connection(("127.0.0.1", self.port)))

    @staticmethod
    def carry(source, target, piece, breaks):
        """Until the source ends, or `breaks(bytes)`, told of each piece, says so; both have ended then."""
        try:
            while data := source.recv(piece):
                target.sendall(data)
                if breaks(len(data)):
                    break
        except OSError:
            pass
        for end in (source, target):
            try:
                end.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass  # it has gone already


def start(work, *args):
    threading.Thread(target=work, args=args, daemon=True).start()
