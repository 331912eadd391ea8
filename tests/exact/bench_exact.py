"""How far renderer/scene is from the cloth by definition (tests/exact): five tight cloths under six configurations with two_lobe.v1, from equal
random numbers. Prints one JSON object a line; standard errors go to standard error.

    bench_exact.py [--build DIR] [--paths N] [CLOTH ...]

mean_error: root mean square of the relative differences of mean radiances, over configurations and channels. derivative_error: of the
common relative differences of the derivatives by each parameter (CommonDifference). Both contain their noise.
tile_length_spread: (largest - smallest) / mean of the radiances of straight fibers in tiles of 2 to 0.02 mm. subdivision_spread: the same of
twill7 with segments whole and cut into 2 and 4, from eight times the paths: the largest over channels, and over the configurations of twill7.
"""
import argparse
import json
import os
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tests", "support", "python"))


def figure(name, value):
    print(json.dumps({"name": name, "value": float(f"{value:.4g}"), "unit": "1", "better": "lower"}), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default="build")
    parser.add_argument("--paths", type=int, default=131072, help="of each configuration")
    parser.add_argument("cloth", nargs="*")
    arguments = parser.parse_args()
    os.environ["SELVEDGE_BUILD"] = os.path.join(ROOT, arguments.build)
    import fiber_file
    import paired_scenes as scenes

    def spread(variants, folder, configurations):
        means = []
        for fibers in variants:
            blocks = scenes.trace(scenes.PRODUCT, fibers.write(os.path.join(folder, "variant.hair")), configurations=configurations, blocks=128,
                                  paths=8 * arguments.paths // 128)
            means.append([scenes.mean_and_se(b[f"mean.{c}"])[0] for b in blocks for c in "rgb"])
        return max((max(m) - min(m)) / (sum(m) / len(m)) for m in zip(*means))

    with tempfile.TemporaryDirectory() as folder:
        for cloth in arguments.cloth or scenes.CLOTHS:
            fibers = scenes.make_cloth(cloth, folder)
            one, other = (scenes.trace(p, fibers, blocks=128, paths=arguments.paths // 128) for p in (scenes.PRODUCT, scenes.EXACT))
            for name, differences in (("mean", scenes.mean_differences(one, other)), ("derivative", scenes.parameter_differences(one, other))):
                value, noise = scenes.root_mean_square(differences)
                figure(f"exact.{cloth}.{name}_error", value)
                print(f"  {name}: standard errors {noise:.2g}; largest {max(differences.items(), key=lambda d: abs(d[1].relative))[0]}", file=sys.stderr)
        figure("exact.tile_length_spread", spread([fiber_file.straight_plies(x) for x in (2, 0.4, 0.1, 0.02)], folder, [[80, 180, 80, 0, 0]]))
        twill = fiber_file.Fibers.read(scenes.make_cloth("twill7", folder))
        figure("exact.subdivision_spread", spread([twill, twill.subdivided(2), twill.subdivided(4)], folder, scenes.CONFIGURATIONS))


if __name__ == "__main__":
    main()
