"""The model by which the time of a fit with many ranks is predicted (docs/ranks.md).

Inputs, all measured: the numbers of tasks of every estimate, the processor time of a task with all that handing it out
takes, that of everything which rank 0 does besides, the time in which a helper prepares an estimate, the time of a
message there and back, the rate of long messages, and the sizes of messages. The hand-out of base/ranks/rank_share.c is
followed task by task."""
import heapq
import struct


def tasks_of(path):
    """Tasks of each estimate in a checkpoint, as renderer/estimate/estimate_blocks.c cuts them."""
    with open(path, "rb") as f:
        data = f.read()
    at, found = 16, []
    while at < len(data):
        n_bytes, _ = struct.unpack_from("<II", data, at)
        payload = data[at + 8:at + 8 + n_bytes]
        _, _, _, n_configuration, n_param, _, _ = struct.unpack_from("<IIIIIId", payload)
        n_path = struct.unpack_from(f"<{n_configuration}Q", payload, 32 + 8 * n_param)
        n_task = 0
        for paths in n_path:
            blocks = -(-paths // 256)
            n_task += -(-blocks // (1 + blocks // 1024))
        found.append(n_task)
        at += 8 + n_bytes
    return found


def depth(rank):
    """Messages that an order takes to this rank: one for each bit that is set."""
    return bin(rank).count("1")


class Helper:
    def __init__(self, start_s, n, task_s):
        self.task_s = task_s
        self.free_s = start_s + n * task_s
        self.ask_s = start_s + max(0, n - 2) * task_s  # before the last task but one, while another one is at hand
        self.tasks = n

    def answered(self, at_s, n):
        """Takes n more tasks, and returns when it asks again; None: it has got its last ones."""
        if n == 0:
            return None
        begin_s = max(self.free_s, at_s)
        ask_s = max(at_s, self.free_s - self.task_s) if n == 1 else begin_s + (n - 2) * self.task_s
        self.free_s = begin_s + n * self.task_s
        self.tasks += n
        return ask_s


def share_s(n_task, ranks, m, order_s, result_s):
    """Time of one estimate. order_s: of an order over one branch of the tree; result_s: that the results of a task take on
    their way into rank 0."""
    task_s, there_s, handle_s = m["task_s"], m["there_s"], m["handle_s"]
    span, now, own, ended = n_task // (2 * ranks), 0.0, n_task // (2 * ranks), 1
    left = n_task - ranks * span
    helpers = [None] + [Helper(depth(r) * order_s + m["prepare_s"], span, task_s) for r in range(1, ranks)]
    messages = [(h.ask_s + there_s, r, False) for r, h in enumerate(helpers) if h]
    heapq.heapify(messages)
    while True:
        while messages and messages[0][0] <= now:
            _, r, last = heapq.heappop(messages)
            now += handle_s
            if last:
                ended += 1
                continue
            n = min(left, max(1, left // (2 * ranks))) if left else 0
            left -= n
            ask_s = helpers[r].answered(now + there_s, n)
            when_s = max(helpers[r].free_s, now + there_s) + there_s if ask_s is None else ask_s + there_s
            heapq.heappush(messages, (when_s, r, ask_s is None))
        if own or left:
            own, left = (own - 1, left) if own else (own, left - 1)
            now += task_s
        elif ended < ranks:
            now = max(now, messages[0][0])
        else:
            return now + result_s * sum(h.tasks for h in helpers if h)


def fit_s(measured, ranks):
    """Seconds of the fit. measured: tasks (of each estimate), task_s, serial_s, prepare_s, there_s (of a short message one
    way), handle_s (that rank 0 spends on a message), bytes_per_s, order_bytes, result_bytes (of a task)."""
    m = measured
    if ranks == 1:
        return m["serial_s"] + sum(m["tasks"]) * m["task_s"]
    order_s = m["there_s"] + m["order_bytes"] / m["bytes_per_s"]
    result_s = m["result_bytes"] / m["bytes_per_s"]
    return m["serial_s"] + sum(share_s(n, ranks, m, order_s, result_s) for n in m["tasks"])


def efficiency(measured, ranks):
    return fit_s(measured, 1) / (ranks * fit_s(measured, ranks))
