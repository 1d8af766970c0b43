// The rod for C++17: std::array in and out, a result in place of exceptions.
//
//     rodmodel::Rod<rodmodel::room(8)> robot(rod);     // `rod` of law.h; its workspace lies in the object
//     rodmodel::Rod<> other(rod, 8);                   // its workspace is a std::vector, allocated once, here
//     rodmodel::Pose pose;
//     if (robot.solve({30e3, 0, 0}, pose) == rodmodel::Result::successful) ... pose.tip_position
//
// Units are SI: m, N, Pa, rad. One object serves one thread at a time.
#ifndef RODMODEL_HPP
#define RODMODEL_HPP

#include <array>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "law.h"

namespace rodmodel {

using real = rm_real;
using Vector = std::array<real, 3>;
using Matrix = std::array<real, 9>; // by rows

enum class Result {
    successful = RM_SUCCESSFUL,
    bad_input = RM_BAD_INPUT, // also where the workspace is too small
    unstable = RM_UNSTABLE,
    not_converged = RM_NOT_CONVERGED,
    unresolved = RM_UNRESOLVED,
    too_many_shots = RM_TOO_MANY_SHOTS
};

// Dead loads, in the world's frame.
struct Loads {
    Vector tip_force{};  // at the centre of the cap's outer face [N]
    Vector tip_moment{}; // on the cap [N m]
    Vector gravity{};    // acceleration [m/s^2]
};

struct Pose {
    Vector tip_position{};       // centre of the cap's outer face [m]
    Matrix tip_rotation{};       // frame of the cap
    std::array<real, 2> bend{};  // (theta cos gamma, theta sin gamma) [rad]
    real bending_angle = 0;      // theta [rad]
    real bending_plane = 0;      // gamma [rad]
    real angle_error = 0;        // of theta in 90 % of states [rad]; NaN outside the calibration
    real tip_error = 0;          // of the tip's position in 90 % of states [m]; NaN also where not known
    bool stable = false;
    bool in_domain = false;      // pressures and moments are those of the calibration
};

// By pressures [1/Pa], tip force [1/N], tip moment [1/(N m)] and gravity [s^2/m]: columns 0-2, 3-5, 6-8, 9-11, by rows.
struct Jacobian {
    std::array<real, 36> position{}; // (3, 12)
    std::array<real, 36> turn{};     // (3, 12)
    std::array<real, 24> bend{};     // (2, 12)
};

struct Pressures {
    Vector pressure{};     // [Pa]
    real distance = 0;     // left to the target [m] or [rad]
    bool reached = false;  // to 0.15 % of the length or 1e-3 rad
    bool nearest = false;  // no pressures in the domain come nearer
};

// Numbers of the workspace of law.h's rod, everything included.
constexpr std::size_t room(int steps)
{
    return ROD_WORKSPACE_SIZE(static_cast<std::size_t>(steps), 1);
}

// A rod and its workspace: of `Room` numbers, or of as many as it takes where that is 0.
template <std::size_t Room = 0> class Rod {
  public:
    explicit Rod(const rm_rod &rod, int steps = 8) : rod_(&rod)
    {
        rm_default_options(&options_);
        options_.steps = steps;
        if constexpr (Room == 0) {
            workspace_.resize(steps > 0 ? rm_workspace_size(rod_, steps, 1) : 0);
        }
    }

    // Equilibrium under pressures [Pa] alone.
    Result solve(const Vector &pressure, Pose &pose) noexcept
    {
        return solve_input(input_of(pressure), pose);
    }

    // Under pressures and loads; from the last such solution, where there is one.
    Result solve(const Vector &pressure, const Loads &loads, Pose &pose) noexcept
    {
        return solve_input(input_of(pressure, loads), pose);
    }

    // Equilibrium and the derivatives of the tip.
    Result solve(const Vector &pressure, const Loads &loads, Pose &pose, Jacobian &jacobian) noexcept
    {
        if (!has_room()) {
            return Result::bad_input;
        }
        const rm_input input = input_of(pressure, loads);
        rm_jacobian found;
        const int result = rm_solve_with_jacobian(rod_, &input, &options_, start(), workspace_.data(), nullptr,
                                                  &solution_, &found, 0, nullptr, nullptr, nullptr);
        keep(result, pose);
        copy(found.position, jacobian.position);
        copy(found.turn, jacobian.turn);
        copy(found.bend, jacobian.bend);
        return static_cast<Result>(result);
    }

    // Pressures that bring the tip to a position [m].
    Result pressures_for_tip(const Vector &position, const Loads &loads, Pressures &found) noexcept
    {
        return invert({{position[0], position[1], position[2]}, 0, 0}, loads, found);
    }

    // Pressures that bend the rod by (theta cos gamma, theta sin gamma) [rad].
    Result pressures_for_bend(const std::array<real, 2> &bend, const Loads &loads, Pressures &found) noexcept
    {
        return invert({{bend[0], bend[1], 0}, 1, 0}, loads, found);
    }

  private:
    const rm_rod *rod_;
    rm_options options_{};
    rm_solution solution_{};
    bool warm_ = false;
    std::conditional_t<Room == 0, std::vector<real>, std::array<real, Room>> workspace_{};

    bool has_room() const noexcept
    {
        return options_.steps > 0 && workspace_.size() >= rm_workspace_size(rod_, options_.steps, 1);
    }

    const real *start() const noexcept
    {
        return warm_ ? solution_.unknown : nullptr;
    }

    static rm_input input_of(const Vector &pressure) noexcept
    {
        rm_input input{};
        put(pressure, input.pressure);
        return input;
    }

    static rm_input input_of(const Vector &pressure, const Loads &loads) noexcept
    {
        rm_input input = input_of(pressure);
        input.given = RM_LOADS;
        put(loads.tip_force, input.tip_force);
        put(loads.tip_moment, input.tip_moment);
        put(loads.gravity, input.gravity);
        return input;
    }

    Result solve_input(const rm_input &input, Pose &pose) noexcept
    {
        if (!has_room()) {
            return Result::bad_input;
        }
        const real *from = input.given != 0 ? start() : nullptr;
        const int result = rm_solve(rod_, &input, &options_, from, workspace_.data(), nullptr, &solution_);
        keep(result, pose);
        return static_cast<Result>(result);
    }

    Result invert(const rm_target &target, const Loads &loads, Pressures &found) noexcept
    {
        if (!has_room()) {
            return Result::bad_input;
        }
        const rm_input input = input_of({}, loads);
        rm_inverse_result result;
        rm_inverse(rod_, &target, &input, &options_, workspace_.data(), &result);
        copy(result.pressure, found.pressure);
        found.distance = result.distance;
        found.reached = result.reached != 0;
        found.nearest = result.nearest != 0;
        return static_cast<Result>(result.solution.result);
    }

    void keep(int result, Pose &pose) noexcept
    {
        warm_ = result == RM_SUCCESSFUL;
        copy(solution_.tip_position, pose.tip_position);
        copy(solution_.tip_rotation, pose.tip_rotation);
        copy(solution_.bend, pose.bend);
        pose.bending_angle = solution_.bending_angle;
        pose.bending_plane = solution_.bending_plane;
        pose.angle_error = solution_.angle_error;
        pose.tip_error = solution_.tip_error;
        pose.stable = solution_.stable != 0;
        pose.in_domain = solution_.in_domain != 0;
    }

    template <std::size_t N> static void copy(const real (&from)[N], std::array<real, N> &to) noexcept
    {
        for (std::size_t k = 0; k < N; k++) {
            to[k] = from[k];
        }
    }

    template <std::size_t N> static void put(const std::array<real, N> &from, real (&to)[N]) noexcept
    {
        for (std::size_t k = 0; k < N; k++) {
            to[k] = from[k];
        }
    }
};

} // namespace rodmodel

#endif
