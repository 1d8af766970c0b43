// Every function of the wrapper: poses without and with loads, a Jacobian, pressures for a tip and for a bend, and what
// it refuses.
#include <cmath>
#include <cstdio>
#include <limits>

#include "rodmodel.hpp"

namespace {

int failures = 0;

void expect(bool good, const char *what)
{
    if (!good) {
        std::printf("# failed: %s\n", what);
        failures++;
    }
}

void print(const rodmodel::Vector &p, bool loaded, const rodmodel::Pose &pose)
{
    std::printf("pose %.17g %.17g %.17g %d", double(p[0]), double(p[1]), double(p[2]), loaded);
    for (rm_real x : pose.tip_position) {
        std::printf(" %.17g", double(x));
    }
    std::printf(" %.17g %.17g\n", double(pose.bend[0]), double(pose.bend[1]));
}

} // namespace

int main()
{
    using rodmodel::Result;
    rodmodel::Rod<rodmodel::room(8)> in_place(rod);
    rodmodel::Rod<> allocated(rod, 8);
    rodmodel::Pose pose, other;
    rodmodel::Loads loads;
    loads.tip_force = {0, rm_real(2e-3), 0};
    loads.gravity = {0, 0, rm_real(9.81)};

    for (int k = 0; k < 4; k++) {
        const rodmodel::Vector pressure = {rm_real(20e3), rm_real(5e3 * k), 0};
        expect(in_place.solve(pressure, pose) == Result::successful && pose.in_domain && pose.stable, "no loads");
        print(pressure, false, pose);
        expect(in_place.solve(pressure, loads, pose) == Result::successful, "loads, warm");
        print(pressure, true, pose);
        expect(allocated.solve(pressure, loads, other) == Result::successful, "loads");
        print(pressure, true, other);
    }
    rodmodel::Jacobian jacobian;
    const rodmodel::Vector pressure = {rm_real(20e3), rm_real(15e3), 0};
    expect(rodmodel::Rod<>(rod).solve(pressure, loads, pose, jacobian) == Result::successful, "Jacobian");
    for (std::size_t row = 0; row < 3; row++) {
        std::printf("jacobian");
        for (std::size_t k = 0; k < 12; k++) {
            std::printf(" %.17g", double(jacobian.position[12 * row + k]));
        }
        std::printf("\n");
    }

    rodmodel::Pressures found;
    expect(in_place.pressures_for_tip(pose.tip_position, loads, found) == Result::successful && found.reached, "tip");
    expect(in_place.solve(found.pressure, loads, other) == Result::successful, "there");
    for (std::size_t k = 0; k < 3; k++) {
        expect(std::fabs(other.tip_position[k] - pose.tip_position[k]) < rm_real(1e-4), "tip is there");
    }
    expect(in_place.pressures_for_bend(pose.bend, loads, found) == Result::successful && found.reached, "bend");

    expect(in_place.solve({-1, 0, 0}, pose) == Result::bad_input && !pose.stable, "pressure below zero");
    expect(in_place.solve({std::numeric_limits<rm_real>::quiet_NaN(), 0, 0}, pose) == Result::bad_input, "NaN");
    rodmodel::Rod<4> small(rod);
    expect(small.solve(pressure, pose) == Result::bad_input, "too small a workspace");
    rodmodel::Rod<> none(rod, 0);
    expect(none.solve(pressure, pose) == Result::bad_input, "no steps");
    expect(none.pressures_for_bend({0, 0}, loads, found) == Result::bad_input, "no steps, inverse");
    std::printf("failures %d\n", failures);
    return failures != 0;
}
