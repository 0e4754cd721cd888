#!/usr/bin/env python3
"""What learned deformers without key points would do: regression from the inputs of the stack alone.

    build/bench_ablation --dump poses.npz scenes/boy/boy.yaml
    python3 bench/baselines.py poses.npz            # needs Debian's python3-sklearn
    python3 bench/baselines.py --list poses.npz     # what is in the file; needs nothing

Ridge regression from local scalars, and from these and entries of world matrices, to the main modes of the points;
then a multi-layer perceptron with two layers of 256 on what each leaves. A tenth of the training poses chooses penalty
and epoch. Errors are those of the test clip in % of the diagonal, as bench_ablation prints them.
"""
import argparse
import ast
import struct
import time
import zipfile

MODES = 200
STILL = 1e-4  # deviations of inputs that are none: metres, entries of rotations, weights
PENALTIES = [10.0**e for e in range(-7, 2)]  # times the number of poses
LAYERS = (256, 256)
RATES = (1e-3, 3e-4, 1e-4)  # each for a third of the time
EPOCHS = 10  # between two looks at the poses that choose


def shapes(path):
    """By name, from the headers alone."""
    found = {}
    with zipfile.ZipFile(path) as archive:
        for name in archive.namelist():
            with archive.open(name) as array:
                magic, major = array.read(6), array.read(2)[0]
                if magic != b"\x93NUMPY":
                    raise ValueError(f"{path}: {name} is no NumPy array")
                size = struct.unpack("<H" if major == 1 else "<I", array.read(2 if major == 1 else 4))[0]
                header = ast.literal_eval(array.read(size).decode("latin1"))
                found[name.removesuffix(".npy")] = (header["descr"], header["shape"])
    return found


class Baselines:
    def __init__(self, path, seconds):
        import numpy

        self.np = np = numpy
        self.seconds = seconds
        with np.load(path) as file:
            data = {name: file[name] for name in file.files}
        self.local, self.diagonal = int(data["local_inputs"]), float(data["diagonal"])
        self.train_inputs, self.train_points = data["train_inputs"], data["train_points"]
        self.test_inputs, self.test_points = data["test_inputs"], data["test_points"]
        # Modes by the snapshot method
        points = self.train_points
        values, vectors = np.linalg.eigh(points.astype(np.float64) @ points.T.astype(np.float64))
        strongest = np.argsort(-values)[:MODES]
        strongest = strongest[values[strongest] > 1e-12 * values[strongest[0]]]
        self.modes = ((points.T @ vectors[:, strongest]) / np.sqrt(values[strongest])).astype(np.float64)
        self.coordinates = points @ self.modes  # of the training poses
        self.chooses = np.random.default_rng(1).permutation(len(points)) < len(points) // 10

    def errors(self, coordinates):
        """RMS over frames and points, and the largest error, in % of the diagonal."""
        left = (self.test_points - coordinates @ self.modes.T).reshape(len(coordinates), -1, 3)
        squares = (left.astype(self.np.float64) ** 2).sum(2)
        return [100 * float(self.np.sqrt(value)) / self.diagonal for value in (squares.mean(), squares.max())]

    def normalised(self, count):
        """The first inputs that move, of deviation 1; some of them move in the test clip alone: left out."""
        np = self.np
        deviation = self.train_inputs[:, :count].astype(np.float64).std(0)
        moving = deviation > STILL
        scale = np.where(moving, deviation, 1)[moving]
        return self.train_inputs[:, :count][:, moving] / scale, self.test_inputs[:, :count][:, moving] / scale

    def ridge(self, x, test):
        """Predictions of the coordinates, of training and test poses."""
        from sklearn.linear_model import Ridge

        keep, least = None, None
        y, fit = self.coordinates, ~self.chooses
        for penalty in PENALTIES:
            model = Ridge(alpha=penalty * fit.sum()).fit(x[fit], y[fit])
            left = float(((model.predict(x[self.chooses]) - y[self.chooses]) ** 2).sum())
            if least is None or left < least:
                keep, least = penalty, left
        model = Ridge(alpha=keep * len(x)).fit(x, y)
        return model.predict(x), model.predict(test)

    def perceptron(self, x, test, rest):
        """Predictions of the rest in the test poses, epochs, and seconds."""
        import copy
        import warnings

        from sklearn.exceptions import ConvergenceWarning
        from sklearn.neural_network import MLPRegressor

        np, fit = self.np, ~self.chooses
        scale = np.sqrt((rest**2).sum(1).mean() / rest.shape[1])
        x, y = x.astype(np.float32), (rest / scale).astype(np.float32)
        model = MLPRegressor(LAYERS, batch_size=64, warm_start=True, max_iter=EPOCHS, n_iter_no_change=EPOCHS + 1,
                             random_state=1)
        best, least, epochs, begin = None, float((y[self.chooses] ** 2).sum()), 0, time.monotonic()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)
            for stage, rate in enumerate(RATES):
                model.set_params(learning_rate_init=rate)
                while time.monotonic() - begin < self.seconds * (stage + 1) / len(RATES):
                    model.fit(x[fit], y[fit])
                    epochs += EPOCHS
                    left = float(((model.predict(x[self.chooses]) - y[self.chooses]) ** 2).sum())
                    if left < least:
                        best, least = copy.deepcopy(model), left
                if best is not None:
                    model = copy.deepcopy(best)  # a lower rate goes on from the best
        spent = time.monotonic() - begin
        if best is None:
            return np.zeros((len(test), rest.shape[1])), epochs, spent
        return best.predict(test.astype(np.float32)) * scale, epochs, spent

    def run(self):
        print(f"{len(self.train_points)} training poses, {len(self.test_points)} test frames, "
              f"{self.modes.shape[1]} modes; RMS % / max % of the diagonal")

        def row(what, coordinates, note=""):
            rms, largest = self.errors(coordinates)
            print(f"{what:<52}{rms:8.4f} / {largest:.3f}{note}", flush=True)

        row("the modes themselves (what none can pass)", self.test_points @ self.modes)
        for what, count in (("local scalars", self.local),
                            ("local scalars and world matrices", self.train_inputs.shape[1])):
            x, test = self.normalised(count)
            fitted, predicted = self.ridge(x, test)
            row(f"linear, {x.shape[1]} {what}", predicted)
            rest, epochs, spent = self.perceptron(x, test, self.coordinates - fitted)
            row("  + 2 x 256 on the rest", predicted + rest, f"   ({epochs} epochs, {spent:.0f} s)")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("poses", help="what bench_ablation --dump wrote")
    parser.add_argument("--list", action="store_true", help="arrays and their shapes, no more")
    parser.add_argument("--seconds", type=float, default=120, help="for each perceptron; 120 if not given")
    options = parser.parse_args()
    if options.list:
        for name, (kind, shape) in shapes(options.poses).items():
            print(name, kind, *shape)
    else:
        Baselines(options.poses, options.seconds).run()


if __name__ == "__main__":
    main()
