#!/usr/bin/env python3
"""Asks a running `kinevox serve` for random poses and says how long they take and whether its memory grows.

  serve_load.py --server http://127.0.0.1:8080 --model mdl_... [--poses 1000] [--clients 1] [--format raw] [--level 0]
                [--pid PID] [--same N] [--seed N]

Angles are drawn within the model's limits, so every request is computed; --same N draws from N poses only, so most are found.
Another --seed draws other poses: give each run of a running service its own.
--pid is the server's process: its resident memory is printed now and then. Ends with 1 when an answer was lost.
"""
import argparse
import http.client
import json
import random
import statistics
import sys
import threading
import time
from urllib.parse import urlencode, urlsplit


def resident_mb(pid):
    with open(f"/proc/{pid}/status") as status:
        return next(int(line.split()[1]) // 1024 for line in status if line.startswith("VmRSS"))


class Load:
    def __init__(self, options):
        self.options, self.lock = options, threading.Lock()
        self.address = urlsplit(options.server).netloc
        self.left, self.seconds, self.lost, self.bytes = options.poses, [], [], 0
        connection = http.client.HTTPConnection(self.address)
        connection.request("GET", f"/v1/models/{options.model}")
        info = json.loads(connection.getresponse().read())
        self.dofs = [(f"{joint['child']}.{dof['name']}", dof["min_deg"], dof["max_deg"])
                     for joint in info["joints"] for dof in joint["dofs"]]

    def path(self, number):
        draw = random.Random(f"{self.options.seed}/{number % self.options.same if self.options.same else number}")
        query = {name: round(draw.uniform(low, high), 3) for name, low, high in self.dofs}
        query.update(format=self.options.format, level=self.options.level)
        return f"/v1/models/{self.options.model}/volume?{urlencode(query)}"

    def client(self):
        connection = http.client.HTTPConnection(self.address, timeout=120)
        while True:
            with self.lock:
                if self.left == 0:
                    return
                self.left -= 1
                number = self.left
            start = time.perf_counter()
            try:
                connection.request("GET", self.path(number), headers={"Accept-Encoding": "identity"})
                answer = connection.getresponse()
                size, status = len(answer.read()), answer.status
            except (OSError, http.client.HTTPException) as error:
                size, status = 0, repr(error)
                connection.close()
            with self.lock:
                self.seconds.append(time.perf_counter() - start)
                self.bytes += size
                if status != 200:
                    self.lost.append(status)
                if self.options.pid and len(self.seconds) % max(1, self.options.poses // 10) == 0:
                    print(f"{len(self.seconds)} poses, {resident_mb(self.options.pid)} MB resident", flush=True)

    def run(self):
        start = time.perf_counter()
        threads = [threading.Thread(target=self.client) for _ in range(self.options.clients)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        took = time.perf_counter() - start
        ordered = sorted(self.seconds)
        print(f"{len(ordered)} answers, {len(self.lost)} lost {set(self.lost) or ''}: median {1e3 * statistics.median(ordered):.1f} ms, "
              f"90 % within {1e3 * ordered[int(0.9 * (len(ordered) - 1))]:.1f}, p99 {1e3 * ordered[int(0.99 * (len(ordered) - 1))]:.1f} ms, {len(ordered) / took:.1f} a second, "
              f"{self.bytes / len(ordered) / 1e6:.1f} MB each")
        return 1 if self.lost else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--server", default="http://127.0.0.1:8080")
    parser.add_argument("--model", required=True)
    parser.add_argument("--poses", type=int, default=1000)
    parser.add_argument("--clients", type=int, default=1)
    parser.add_argument("--format", default="raw")
    parser.add_argument("--level", type=int, default=0)
    parser.add_argument("--same", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--pid", type=int)
    return Load(parser.parse_args()).run()


if __name__ == "__main__":
    sys.exit(main())
