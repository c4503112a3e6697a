"""An HTTP proxy between the program and the service that does as it is told with single requests."""
import http.client
import http.server
import socket
import threading


class Meddler:
    """`meddle(n, method, path)` says what becomes of request n (from 1 on): "lose the answer", be "busy", "cut"
    the answer at `cut_at` bytes, pass it on "chunked"; None: nothing."""

    def __init__(self, port, meddle, cut_at=0):
        self.port, self.meddle, self.cut_at = port, meddle, cut_at
        self.asked, self.carried = [], 0  # (method, path, Range); bytes of bodies that went back
        self.lock = threading.Lock()

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"
            owner = self

            def log_message(self, *_):
                pass

            def go(self):
                self.owner.answer(self)

            do_GET = do_POST = do_PUT = do_HEAD = do_PATCH = do_DELETE = go

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = "http://127.0.0.1:%d" % self.server.server_port
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def answer(self, request):
        length = int(request.headers.get("Content-Length") or 0)
        body = request.rfile.read(length) if length else None
        with self.lock:
            self.asked.append((request.command, request.path, request.headers.get("Range")))
            what = self.meddle(len(self.asked), request.command, request.path)
        if what == "busy":
            return self.say(request, 503, [("Retry-After", "1"), ("Content-Length", "0")], b"")
        status, headers, data = self.pass_on(request, body)
        if what == "lose the answer":
            return self.hang_up(request)
        if what == "chunked":
            headers = [(k, v) for k, v in headers if k != "Content-Length"] + [("Transfer-Encoding", "chunked")]
            parts = [data[i:i + 65536] for i in range(0, len(data), 65536)] + [b""]
            data = b"".join(b"%x\r\n%b\r\n" % (len(part), part) for part in parts)
        short = what == "cut" and len(data) > self.cut_at
        self.say(request, status, headers, data[:self.cut_at] if short else data)
        if short:
            self.hang_up(request)

    def pass_on(self, request, body):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=120)
        left_out = ("host", "connection", "keep-alive", "transfer-encoding")
        connection.request(request.command, request.path, body, {k: v for k, v in request.headers.items() if k.lower() not in left_out})
        answer = connection.getresponse()
        data = answer.read()
        connection.close()
        return answer.status, [(k, v) for k, v in answer.getheaders() if k.lower() not in left_out], data

    def say(self, request, status, headers, data):
        request.send_response(status)
        for name, value in headers:
            request.send_header(name, value)
        request.end_headers()
        request.wfile.write(data)
        request.wfile.flush()
        self.carried += len(data)

    @staticmethod
    def hang_up(request):
        request.close_connection = True
        request.connection.shutdown(socket.SHUT_RDWR)
