/* SPDX-License-Identifier: Apache-2.0 */
/* layout.h: size of every public struct and place of every field, as they are on LP64.
 *
 * A line that fails means that plugins compiled before no longer fit: a field may only be added at
 * the end of a struct that carries its size, everything else needs a new ABI or interface
 * revision. Read by C and by C++, so that both agree. */
#include <mhe/cost.h>
#include <mhe/integrator.h>
#include <mhe/model.h>
#include <mhe/muscle.h>
#include <mhe/solver.h>

#include <assert.h>

#define SIZE(T, bytes) static_assert(sizeof(T) == (bytes), "size of " #T)
#define AT(T, field, bytes) static_assert(offsetof(T, field) == (bytes), #T "." #field)

SIZE(mhe_error, 772);
AT(mhe_error, code, 0);
AT(mhe_error, text, 4);

SIZE(mhe_host, 32);
AT(mhe_host, size, 0);
AT(mhe_host, data, 8);
AT(mhe_host, log, 16);
AT(mhe_host, service, 24);

SIZE(mhe_real_list, 16);
AT(mhe_real_list, values, 0);
AT(mhe_real_list, n, 8);

SIZE(mhe_text_list, 16);
AT(mhe_text_list, values, 0);
AT(mhe_text_list, n, 8);

SIZE(mhe_text_map, 24);
AT(mhe_text_map, keys, 0);
AT(mhe_text_map, values, 8);
AT(mhe_text_map, n, 16);

SIZE(mhe_option, 88);
AT(mhe_option, key, 0);
AT(mhe_option, help, 8);
AT(mhe_option, unit, 16);
AT(mhe_option, choices, 24);
AT(mhe_option, text_default, 32);
AT(mhe_option, replaced_by, 40);
AT(mhe_option, real_default, 48);
AT(mhe_option, min, 56);
AT(mhe_option, max, 64);
AT(mhe_option, type, 72);
AT(mhe_option, flags, 76);
AT(mhe_option, offset, 80);

SIZE(mhe_plugin, 88);
AT(mhe_plugin, size, 0);
AT(mhe_plugin, flags, 4);
AT(mhe_plugin, id, 8);
AT(mhe_plugin, version, 16);
AT(mhe_plugin, summary, 24);
AT(mhe_plugin, reference, 32);
AT(mhe_plugin, iface, 40);
AT(mhe_plugin, ops, 48);
AT(mhe_plugin, config_size, 56);
AT(mhe_plugin, option_size, 60);
AT(mhe_plugin, option_count, 64);
AT(mhe_plugin, options, 72);
AT(mhe_plugin, extension, 80);

SIZE(mhe_library, 24);
AT(mhe_library, magic, 0);
AT(mhe_library, abi_major, 4);
AT(mhe_library, abi_minor, 6);
AT(mhe_library, size, 8);
AT(mhe_library, plugin_count, 12);
AT(mhe_library, plugins, 16);

SIZE(mhe_function, 24);
AT(mhe_function, origin, 0);
AT(mhe_function, coef, 8);
AT(mhe_function, n_pieces, 16);

SIZE(mhe_motion, 56);
AT(mhe_motion, kind, 0);
AT(mhe_motion, coordinate, 4);
AT(mhe_motion, axis, 8);
AT(mhe_motion, function, 32);

SIZE(mhe_body, 320);
AT(mhe_body, name, 0);
AT(mhe_body, parent, 8);
AT(mhe_body, n_motions, 12);
AT(mhe_body, motions, 16);
AT(mhe_body, joint_r, 24);
AT(mhe_body, joint_p, 96);
AT(mhe_body, body_r, 120);
AT(mhe_body, body_p, 192);
AT(mhe_body, mass, 216);
AT(mhe_body, com, 224);
AT(mhe_body, inertia, 248);

SIZE(mhe_coordinate, 48);
AT(mhe_coordinate, name, 0);
AT(mhe_coordinate, rotational, 8);
AT(mhe_coordinate, lower, 16);
AT(mhe_coordinate, upper, 24);
AT(mhe_coordinate, value, 32);
AT(mhe_coordinate, speed, 40);

SIZE(mhe_marker, 40);
AT(mhe_marker, name, 0);
AT(mhe_marker, body, 8);
AT(mhe_marker, location, 16);

SIZE(mhe_path_point, 32);
AT(mhe_path_point, body, 0);
AT(mhe_path_point, location, 8);

SIZE(mhe_muscle, 128);
AT(mhe_muscle, name, 0);
AT(mhe_muscle, type, 8);
AT(mhe_muscle, n_points, 12);
AT(mhe_muscle, points, 16);
AT(mhe_muscle, max_isometric_force, 24);
AT(mhe_muscle, optimal_fiber_length, 32);
AT(mhe_muscle, tendon_slack_length, 40);
AT(mhe_muscle, pennation_angle, 48);
AT(mhe_muscle, max_contraction_velocity, 56);
AT(mhe_muscle, activation_time, 64);
AT(mhe_muscle, deactivation_time, 72);
AT(mhe_muscle, fiber_damping, 80);
AT(mhe_muscle, passive_strain, 88);
AT(mhe_muscle, passive_shape, 96);
AT(mhe_muscle, active_shape, 104);
AT(mhe_muscle, velocity_shape, 112);
AT(mhe_muscle, max_lengthening_force, 120);

SIZE(mhe_description, 128);
AT(mhe_description, size, 0);
AT(mhe_description, name, 8);
AT(mhe_description, source, 16);
AT(mhe_description, gravity, 24);
AT(mhe_description, n_bodies, 48);
AT(mhe_description, n_coordinates, 52);
AT(mhe_description, n_markers, 56);
AT(mhe_description, n_muscles, 60);
AT(mhe_description, bodies, 64);
AT(mhe_description, coordinates, 72);
AT(mhe_description, markers, 80);
AT(mhe_description, muscles, 88);
AT(mhe_description, n_unsupported, 96);
AT(mhe_description, unsupported, 104);
AT(mhe_description, n_warnings, 112);
AT(mhe_description, warnings, 120);

SIZE(mhe_problem, 80);
AT(mhe_problem, size, 0);
AT(mhe_problem, formulation, 4);
AT(mhe_problem, n_q, 8);
AT(mhe_problem, n_muscles, 12);
AT(mhe_problem, n_markers, 16);
AT(mhe_problem, n_residual_torques, 20);
AT(mhe_problem, n_intervals, 24);
AT(mhe_problem, interval, 32);
AT(mhe_problem, coordinate_names, 40);
AT(mhe_problem, muscle_names, 48);
AT(mhe_problem, marker_names, 56);
AT(mhe_problem, data, 64);
AT(mhe_problem, find_signal, 72);

SIZE(mhe_cost_layout, 104);
AT(mhe_cost_layout, size, 0);
AT(mhe_cost_layout, signal, 4);
AT(mhe_cost_layout, n_signals, 8);
AT(mhe_cost_layout, signals, 12);
AT(mhe_cost_layout, n_res, 76);
AT(mhe_cost_layout, jacobian, 80);
AT(mhe_cost_layout, scratch_bytes, 84);
AT(mhe_cost_layout, res_unit, 88);
AT(mhe_cost_layout, fills_missing, 96);

SIZE(mhe_stage, 48);
AT(mhe_stage, size, 0);
AT(mhe_stage, node, 4);
AT(mhe_stage, n_intervals, 8);
AT(mhe_stage, ny, 12);
AT(mhe_stage, time, 16);
AT(mhe_stage, y, 24);
AT(mhe_stage, y_ref, 32);
AT(mhe_stage, scratch, 40);

SIZE(mhe_muscle_force, 40);
AT(mhe_muscle_force, size, 0);
AT(mhe_muscle_force, force, 8);
AT(mhe_muscle_force, force_a, 16);
AT(mhe_muscle_force, force_l, 24);
AT(mhe_muscle_force, force_w, 32);

SIZE(mhe_muscle_ops, 40);
AT(mhe_muscle_ops, size, 0);
AT(mhe_muscle_ops, create, 8);
AT(mhe_muscle_ops, destroy, 16);
AT(mhe_muscle_ops, force, 24);
AT(mhe_muscle_ops, activation_rate, 32);

SIZE(mhe_kinematics, 64);
AT(mhe_kinematics, size, 0);
AT(mhe_kinematics, mass, 8);
AT(mhe_kinematics, bias, 16);
AT(mhe_kinematics, length, 24);
AT(mhe_kinematics, length_q, 32);
AT(mhe_kinematics, length_qq, 40);
AT(mhe_kinematics, marker, 48);
AT(mhe_kinematics, marker_q, 56);

SIZE(mhe_model_ops, 64);
AT(mhe_model_ops, size, 0);
AT(mhe_model_ops, create, 8);
AT(mhe_model_ops, destroy, 16);
AT(mhe_model_ops, context_create, 24);
AT(mhe_model_ops, context_destroy, 32);
AT(mhe_model_ops, kinematics, 40);
AT(mhe_model_ops, inverse_dynamics, 48);
AT(mhe_model_ops, forward_dynamics, 56);

SIZE(mhe_acceleration, 48);
AT(mhe_acceleration, size, 0);
AT(mhe_acceleration, vdot, 8);
AT(mhe_acceleration, vdot_q, 16);
AT(mhe_acceleration, vdot_v, 24);
AT(mhe_acceleration, vdot_a, 32);
AT(mhe_acceleration, vdot_r, 40);

SIZE(mhe_system, 56);
AT(mhe_system, size, 0);
AT(mhe_system, n_q, 4);
AT(mhe_system, n_m, 8);
AT(mhe_system, n_r, 12);
AT(mhe_system, n_a, 16);
AT(mhe_system, n_x, 20);
AT(mhe_system, n_u, 24);
AT(mhe_system, data, 32);
AT(mhe_system, acceleration, 40);
AT(mhe_system, activation_rate, 48);

SIZE(mhe_integrator_ops, 56);
AT(mhe_integrator_ops, size, 0);
AT(mhe_integrator_ops, create, 8);
AT(mhe_integrator_ops, destroy, 16);
AT(mhe_integrator_ops, context_create, 24);
AT(mhe_integrator_ops, context_destroy, 32);
AT(mhe_integrator_ops, step, 40);
AT(mhe_integrator_ops, memory_size, 48);

SIZE(mhe_stage_values, 80);
AT(mhe_stage_values, size, 0);
AT(mhe_stage_values, cost, 8);
AT(mhe_stage_values, grad_x, 16);
AT(mhe_stage_values, grad_u, 24);
AT(mhe_stage_values, hess_xx, 32);
AT(mhe_stage_values, hess_ux, 40);
AT(mhe_stage_values, hess_uu, 48);
AT(mhe_stage_values, x_next, 56);
AT(mhe_stage_values, A, 64);
AT(mhe_stage_values, B, 72);

SIZE(mhe_stage_problem, 112);
AT(mhe_stage_problem, size, 0);
AT(mhe_stage_problem, n_intervals, 4);
AT(mhe_stage_problem, n_x, 8);
AT(mhe_stage_problem, n_u, 12);
AT(mhe_stage_problem, n_workers, 16);
AT(mhe_stage_problem, x_lower, 24);
AT(mhe_stage_problem, x_upper, 32);
AT(mhe_stage_problem, u_lower, 40);
AT(mhe_stage_problem, u_upper, 48);
AT(mhe_stage_problem, A_pattern, 56);
AT(mhe_stage_problem, B_pattern, 64);
AT(mhe_stage_problem, xx_pattern, 72);
AT(mhe_stage_problem, ux_pattern, 80);
AT(mhe_stage_problem, uu_pattern, 88);
AT(mhe_stage_problem, data, 96);
AT(mhe_stage_problem, evaluate, 104);

SIZE(mhe_solution, 64);
AT(mhe_solution, size, 0);
AT(mhe_solution, has_multipliers, 4);
AT(mhe_solution, x, 8);
AT(mhe_solution, u, 16);
AT(mhe_solution, lambda, 24);
AT(mhe_solution, zx_lower, 32);
AT(mhe_solution, zx_upper, 40);
AT(mhe_solution, zu_lower, 48);
AT(mhe_solution, zu_upper, 56);

SIZE(mhe_solve_control, 32);
AT(mhe_solve_control, size, 0);
AT(mhe_solve_control, deadline, 8);
AT(mhe_solve_control, data, 16);
AT(mhe_solve_control, progress, 24);

SIZE(mhe_solve_info, 48);
AT(mhe_solve_info, size, 0);
AT(mhe_solve_info, outcome, 4);
AT(mhe_solve_info, iterations, 8);
AT(mhe_solve_info, objective, 16);
AT(mhe_solve_info, kkt_residual, 24);
AT(mhe_solve_info, primal_residual, 32);
AT(mhe_solve_info, evaluation_time, 40);

SIZE(mhe_solver_ops, 40);
AT(mhe_solver_ops, size, 0);
AT(mhe_solver_ops, create, 8);
AT(mhe_solver_ops, destroy, 16);
AT(mhe_solver_ops, solve, 24);
AT(mhe_solver_ops, prepare, 32);
