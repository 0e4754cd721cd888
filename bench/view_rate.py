#!/usr/bin/env python3
"""Requests a second of `kpsa view`, as one slider moves: python3 bench/view_rate.py ADDRESS CONTROL [CLIP]

ADDRESS is what the program printed. For each mode: requests a second over one connection, what a request takes, and what
of that the evaluation takes (medians, milliseconds); of the accelerated side, how many frames were hits. Where the rig has
handles, the first one that the control belongs to is dragged to and fro as well, with nothing evaluated but one side.
"""
import http.client
import json
import statistics
import struct
import sys
import time
import urllib.parse

FRAMES = 300


def main():
    address = urllib.parse.urlparse(sys.argv[1])
    token = urllib.parse.parse_qs(address.query)["token"][0]
    name, clip = sys.argv[2], sys.argv[3] if len(sys.argv) > 3 else None
    server = http.client.HTTPConnection(address.netloc)

    def ask(method, path, body=None):
        server.request(method, path, body, {"X-Kpsa-Token": token})
        answer = server.getresponse()
        data = answer.read()
        if answer.status != 200:
            sys.exit(data.decode())
        return data

    meta = json.loads(ask("GET", "/meta.json"))
    control = next(c for c in meta["controls"] if c["name"] == name)
    print(f"{meta['rig']}: {meta['points']} vertices, {len(meta['controls'])} controls; {name}")

    def rate(label, mode, change):
        took, evaluated, hits, size = [], [], 0, 0
        begin = time.perf_counter()
        for i in range(FRAMES):
            share = abs((2 * i / FRAMES * 3) % 2 - 1)  # to and fro
            request = {"id": i, "set": {}, "clip": clip, "time": 0.5 if clip else 0, "mode": mode, **change(share)}
            asked = time.perf_counter()
            data = ask("POST", "/evaluate", json.dumps(request))
            took.append(time.perf_counter() - asked)
            facts = json.loads(data[4:4 + struct.unpack("<I", data[:4])[0]])
            evaluated.append(sum(facts.get(k, 0) for k in ("full_us", "accelerated_us")) / 1000)
            hits += facts["verdict"] == "hit"
            size = len(data)
        seconds = time.perf_counter() - begin
        told = f", {hits} of {FRAMES} hits" if mode != "full" else ""
        print(f"{label:>12}: {FRAMES / seconds:7.0f} requests/s, {1000 * statistics.median(took):.2f} ms a request, "
              f"{statistics.median(evaluated):.2f} ms of it evaluation, {size / 1e6:.2f} MB{told}")

    for mode in ["full", "accelerated", "both"] if meta["accelerated"] else ["full"]:
        rate(mode, mode, lambda share: {"set": {name: control["min"] + share * (control["max"] - control["min"])}})
    for h, handle in enumerate(meta.get("handles", [])):
        if name in handle["controls"]:
            x, y, z = handle["position"]
            rate("dragged", "accelerated" if meta["accelerated"] else "full", lambda share: {"handles": True, "drag": {
                "handle": h, "from": [x, y, z + 1], "along": [0.02 * (share - 0.5), 0.02 * (share - 0.5), -1]}})
            break


if __name__ == "__main__":
    main()
