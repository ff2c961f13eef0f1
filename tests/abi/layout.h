/* SPDX-License-Identifier: Apache-2.0 */
/* layout.h: size of every public struct and place of every field, as they are on LP64.
 *
 * A line that fails means that plugins compiled before no longer fit: a field may only be added at
 * the end of a struct that carries its size, everything else needs a new ABI or interface
 * revision. Read by C and by C++, so that both agree. */
#include <mhe/cost.h>
#include <mhe/force.h>
#include <mhe/integrator.h>
#include <mhe/layout.h>
#include <mhe/model.h>
#include <mhe/muscle.h>
#include <mhe/solver.h>

#include <assert.h>

#define SIZE(T, bytes) static_assert(sizeof(T) == (bytes), "size of " #T)
#define AT(T, field, bytes) static_assert(offsetof(T, field) == (bytes), #T "." #field)

SIZE(mhe_error, 780);
AT(mhe_error, code, 0);
AT(mhe_error, text, 4);
AT(mhe_error, part, 772);
AT(mhe_error, entry, 776);

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
AT(mhe_function, n_coef, 20);

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

SIZE(mhe_dependent, 80);
AT(mhe_dependent, coordinate, 0);
AT(mhe_dependent, independent, 48);
AT(mhe_dependent, function, 56);

SIZE(mhe_constant, 32);
AT(mhe_constant, name, 0);
AT(mhe_constant, rotational, 8);
AT(mhe_constant, value, 16);
AT(mhe_constant, body, 24);

SIZE(mhe_marker, 40);
AT(mhe_marker, name, 0);
AT(mhe_marker, body, 8);
AT(mhe_marker, location, 16);

SIZE(mhe_path_point, 136);
AT(mhe_path_point, kind, 0);
AT(mhe_path_point, body, 4);
AT(mhe_path_point, location, 8);
AT(mhe_path_point, coordinate, 32);
AT(mhe_path_point, function, 48);
AT(mhe_path_point, lower, 120);
AT(mhe_path_point, upper, 128);

SIZE(mhe_obstacle, 144);
AT(mhe_obstacle, name, 0);
AT(mhe_obstacle, kind, 8);
AT(mhe_obstacle, body, 12);
AT(mhe_obstacle, r, 16);
AT(mhe_obstacle, p, 88);
AT(mhe_obstacle, size, 112);
AT(mhe_obstacle, side_axis, 136);
AT(mhe_obstacle, side_sign, 140);

SIZE(mhe_path_wrap, 16);
AT(mhe_path_wrap, obstacle, 0);
AT(mhe_path_wrap, first, 4);
AT(mhe_path_wrap, last, 8);
AT(mhe_path_wrap, method, 12);

SIZE(mhe_polynomial, 56);
AT(mhe_polynomial, n, 0);
AT(mhe_polynomial, coordinate, 8);
AT(mhe_polynomial, centre, 16);
AT(mhe_polynomial, scale, 24);
AT(mhe_polynomial, n_terms, 32);
AT(mhe_polynomial, coef, 40);
AT(mhe_polynomial, exponent, 48);

SIZE(mhe_path, 48);
AT(mhe_path, name, 0);
AT(mhe_path, n_points, 8);
AT(mhe_path, n_wraps, 12);
AT(mhe_path, points, 16);
AT(mhe_path, wraps, 24);
AT(mhe_path, length, 32);
AT(mhe_path, line, 40);

SIZE(mhe_millard_curves, 176);
AT(mhe_millard_curves, min_norm_active_fiber_length, 0);
AT(mhe_millard_curves, transition_norm_fiber_length, 8);
AT(mhe_millard_curves, max_norm_active_fiber_length, 16);
AT(mhe_millard_curves, shallow_ascending_slope, 24);
AT(mhe_millard_curves, minimum_value, 32);
AT(mhe_millard_curves, concentric_slope_at_vmax, 40);
AT(mhe_millard_curves, concentric_slope_near_vmax, 48);
AT(mhe_millard_curves, isometric_slope, 56);
AT(mhe_millard_curves, eccentric_slope_at_vmax, 64);
AT(mhe_millard_curves, eccentric_slope_near_vmax, 72);
AT(mhe_millard_curves, max_eccentric_velocity_force_multiplier, 80);
AT(mhe_millard_curves, concentric_curviness, 88);
AT(mhe_millard_curves, eccentric_curviness, 96);
AT(mhe_millard_curves, fiber_strain_at_zero_force, 104);
AT(mhe_millard_curves, fiber_strain_at_one_norm_force, 112);
AT(mhe_millard_curves, fiber_stiffness_at_low_force, 120);
AT(mhe_millard_curves, fiber_stiffness_at_one_norm_force, 128);
AT(mhe_millard_curves, fiber_curviness, 136);
AT(mhe_millard_curves, tendon_strain_at_one_norm_force, 144);
AT(mhe_millard_curves, tendon_stiffness_at_one_norm_force, 152);
AT(mhe_millard_curves, tendon_norm_force_at_toe_end, 160);
AT(mhe_millard_curves, tendon_curviness, 168);

SIZE(mhe_muscle, 440);
AT(mhe_muscle, name, 0);
AT(mhe_muscle, type, 8);
AT(mhe_muscle, line, 12);
AT(mhe_muscle, max_isometric_force, 16);
AT(mhe_muscle, optimal_fiber_length, 24);
AT(mhe_muscle, tendon_slack_length, 32);
AT(mhe_muscle, pennation_angle, 40);
AT(mhe_muscle, maximum_pennation_angle, 48);
AT(mhe_muscle, max_contraction_velocity, 56);
AT(mhe_muscle, activation_time, 64);
AT(mhe_muscle, deactivation_time, 72);
AT(mhe_muscle, minimum_activation, 80);
AT(mhe_muscle, min_control, 88);
AT(mhe_muscle, max_control, 96);
AT(mhe_muscle, fiber_damping, 104);
AT(mhe_muscle, passive_strain, 112);
AT(mhe_muscle, passive_shape, 120);
AT(mhe_muscle, active_shape, 128);
AT(mhe_muscle, velocity_shape, 136);
AT(mhe_muscle, max_lengthening_force, 144);
AT(mhe_muscle, tendon_strain, 152);
AT(mhe_muscle, ignore_tendon_compliance, 160);
AT(mhe_muscle, ignore_activation_dynamics, 164);
AT(mhe_muscle, millard, 168);
AT(mhe_muscle, active_force_length, 344);
AT(mhe_muscle, passive_force_length, 368);
AT(mhe_muscle, tendon_force_length, 392);
AT(mhe_muscle, force_velocity, 416);

SIZE(mhe_coordinate_limit, 64);
AT(mhe_coordinate_limit, name, 0);
AT(mhe_coordinate_limit, coordinate, 8);
AT(mhe_coordinate_limit, upper, 16);
AT(mhe_coordinate_limit, lower, 24);
AT(mhe_coordinate_limit, upper_stiffness, 32);
AT(mhe_coordinate_limit, lower_stiffness, 40);
AT(mhe_coordinate_limit, damping, 48);
AT(mhe_coordinate_limit, transition, 56);

SIZE(mhe_path_spring, 32);
AT(mhe_path_spring, path, 0);
AT(mhe_path_spring, pushes, 4);
AT(mhe_path_spring, stiffness, 8);
AT(mhe_path_spring, rest, 16);
AT(mhe_path_spring, dissipation, 24);

SIZE(mhe_ligament, 48);
AT(mhe_ligament, path, 0);
AT(mhe_ligament, rest, 8);
AT(mhe_ligament, scale, 16);
AT(mhe_ligament, curve, 24);

SIZE(mhe_coordinate_spring, 40);
AT(mhe_coordinate_spring, name, 0);
AT(mhe_coordinate_spring, coordinate, 8);
AT(mhe_coordinate_spring, stiffness, 16);
AT(mhe_coordinate_spring, rest, 24);
AT(mhe_coordinate_spring, viscosity, 32);

SIZE(mhe_bushing, 304);
AT(mhe_bushing, name, 0);
AT(mhe_bushing, body, 8);
AT(mhe_bushing, r, 16);
AT(mhe_bushing, p, 160);
AT(mhe_bushing, rotational_stiffness, 208);
AT(mhe_bushing, translational_stiffness, 232);
AT(mhe_bushing, rotational_damping, 256);
AT(mhe_bushing, translational_damping, 280);

SIZE(mhe_actuator, 104);
AT(mhe_actuator, name, 0);
AT(mhe_actuator, kind, 8);
AT(mhe_actuator, coordinate, 12);
AT(mhe_actuator, body, 16);
AT(mhe_actuator, axis, 24);
AT(mhe_actuator, point, 48);
AT(mhe_actuator, axis_in_ground, 72);
AT(mhe_actuator, optimal_force, 80);
AT(mhe_actuator, min_control, 88);
AT(mhe_actuator, max_control, 96);

SIZE(mhe_loop, 224);
AT(mhe_loop, name, 0);
AT(mhe_loop, kind, 8);
AT(mhe_loop, body, 12);
AT(mhe_loop, r, 24);
AT(mhe_loop, p, 168);
AT(mhe_loop, line, 216);

SIZE(mhe_description, 304);
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
AT(mhe_description, n_dependents, 96);
AT(mhe_description, n_constants, 100);
AT(mhe_description, dependents, 104);
AT(mhe_description, constants, 112);
AT(mhe_description, n_paths, 120);
AT(mhe_description, n_obstacles, 124);
AT(mhe_description, paths, 128);
AT(mhe_description, obstacles, 136);
AT(mhe_description, n_limits, 144);
AT(mhe_description, n_path_springs, 148);
AT(mhe_description, n_ligaments, 152);
AT(mhe_description, n_coordinate_springs, 156);
AT(mhe_description, n_bushings, 160);
AT(mhe_description, n_actuators, 164);
AT(mhe_description, n_loops, 168);
AT(mhe_description, limits, 176);
AT(mhe_description, path_springs, 184);
AT(mhe_description, ligaments, 192);
AT(mhe_description, coordinate_springs, 200);
AT(mhe_description, bushings, 208);
AT(mhe_description, actuators, 216);
AT(mhe_description, loops, 224);
AT(mhe_description, n_unsupported, 232);
AT(mhe_description, unsupported, 240);
AT(mhe_description, n_warnings, 248);
AT(mhe_description, warnings, 256);
AT(mhe_description, n_dropped, 264);
AT(mhe_description, dropped, 272);
AT(mhe_description, joints, 280);
AT(mhe_description, motion_lower, 288);
AT(mhe_description, motion_upper, 296);

SIZE(mhe_block, 72);
AT(mhe_block, name, 0);
AT(mhe_block, role, 8);
AT(mhe_block, structure, 12);
AT(mhe_block, first, 16);
AT(mhe_block, count, 20);
AT(mhe_block, entry_names, 24);
AT(mhe_block, units, 32);
AT(mhe_block, owner, 40);
AT(mhe_block, lower, 48);
AT(mhe_block, upper, 56);
AT(mhe_block, scale, 64);

SIZE(mhe_layout, 40);
AT(mhe_layout, size, 0);
AT(mhe_layout, block_size, 4);
AT(mhe_layout, n_blocks, 8);
AT(mhe_layout, blocks, 16);
AT(mhe_layout, n_x, 24);
AT(mhe_layout, n_u, 28);
AT(mhe_layout, n_w, 32);
AT(mhe_layout, n_p, 36);

SIZE(mhe_problem, 96);
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
AT(mhe_problem, entry_names, 80);
AT(mhe_problem, layout, 88);

SIZE(mhe_cost_layout, 168);
AT(mhe_cost_layout, size, 0);
AT(mhe_cost_layout, signal, 4);
AT(mhe_cost_layout, n_signals, 8);
AT(mhe_cost_layout, signals, 12);
AT(mhe_cost_layout, at, 76);
AT(mhe_cost_layout, n_res, 140);
AT(mhe_cost_layout, jacobian, 144);
AT(mhe_cost_layout, scratch_bytes, 148);
AT(mhe_cost_layout, res_unit, 152);
AT(mhe_cost_layout, fills_missing, 160);

SIZE(mhe_stage, 56);
AT(mhe_stage, size, 0);
AT(mhe_stage, node, 4);
AT(mhe_stage, n_intervals, 8);
AT(mhe_stage, ny, 12);
AT(mhe_stage, time, 16);
AT(mhe_stage, y, 24);
AT(mhe_stage, y_ref, 32);
AT(mhe_stage, scratch, 40);
AT(mhe_stage, y_spread, 48);

SIZE(mhe_cost_ops, 48);
AT(mhe_cost_ops, size, 0);
AT(mhe_cost_ops, create, 8);
AT(mhe_cost_ops, destroy, 16);
AT(mhe_cost_ops, layout, 24);
AT(mhe_cost_ops, residual, 32);
AT(mhe_cost_ops, jacobian, 40);
SIZE(mhe_own_costs, 24);
AT(mhe_own_costs, data, 8);
AT(mhe_own_costs, find, 16);

SIZE(mhe_kinematics, 96);
AT(mhe_kinematics, size, 0);
AT(mhe_kinematics, mass, 8);
AT(mhe_kinematics, bias, 16);
AT(mhe_kinematics, length, 24);
AT(mhe_kinematics, length_q, 32);
AT(mhe_kinematics, length_qq, 40);
AT(mhe_kinematics, marker, 48);
AT(mhe_kinematics, marker_q, 56);
AT(mhe_kinematics, body, 64);
AT(mhe_kinematics, body_q, 72);
AT(mhe_kinematics, dependent, 80);
AT(mhe_kinematics, lengths_clear, 88);

SIZE(mhe_load, 12);
AT(mhe_load, body, 0);
AT(mhe_load, axes, 4);
AT(mhe_load, origin, 8);

SIZE(mhe_model_ops, 96);
AT(mhe_model_ops, size, 0);
AT(mhe_model_ops, create, 8);
AT(mhe_model_ops, destroy, 16);
AT(mhe_model_ops, context_create, 24);
AT(mhe_model_ops, context_destroy, 32);
AT(mhe_model_ops, kinematics, 40);
AT(mhe_model_ops, inverse_dynamics, 48);
AT(mhe_model_ops, forward_dynamics, 56);
AT(mhe_model_ops, loads, 64);
AT(mhe_model_ops, path_pattern, 72);
AT(mhe_model_ops, path_points, 80);
AT(mhe_model_ops, loops, 88);
SIZE(mhe_loop_values, 72);
AT(mhe_loop_values, size, 0);
AT(mhe_loop_values, gap, 8);
AT(mhe_loop_values, gap_q, 16);
AT(mhe_loop_values, rate, 24);
AT(mhe_loop_values, rate_q, 32);
AT(mhe_loop_values, rate_v, 40);
AT(mhe_loop_values, acceleration, 48);
AT(mhe_loop_values, acceleration_q, 56);
AT(mhe_loop_values, acceleration_v, 64);

SIZE(mhe_muscle_layout, 80);
AT(mhe_muscle_layout, size, 0);
AT(mhe_muscle_layout, n_states, 4);
AT(mhe_muscle_layout, activation, 8);
AT(mhe_muscle_layout, names, 16);
AT(mhe_muscle_layout, units, 24);
AT(mhe_muscle_layout, lower, 32);
AT(mhe_muscle_layout, upper, 40);
AT(mhe_muscle_layout, present, 48);
AT(mhe_muscle_layout, diagonal, 56);
AT(mhe_muscle_layout, n_parameters, 64);
AT(mhe_muscle_layout, parameter_names, 72);

SIZE(mhe_muscle_point, 40);
AT(mhe_muscle_point, size, 0);
AT(mhe_muscle_point, excitation, 8);
AT(mhe_muscle_point, state, 16);
AT(mhe_muscle_point, length, 24);
AT(mhe_muscle_point, velocity, 32);

SIZE(mhe_muscle_values, 136);
AT(mhe_muscle_values, size, 0);
AT(mhe_muscle_values, force, 8);
AT(mhe_muscle_values, force_s, 16);
AT(mhe_muscle_values, force_l, 24);
AT(mhe_muscle_values, force_w, 32);
AT(mhe_muscle_values, rate, 40);
AT(mhe_muscle_values, rate_e, 48);
AT(mhe_muscle_values, rate_s, 56);
AT(mhe_muscle_values, rate_l, 64);
AT(mhe_muscle_values, rate_w, 72);
AT(mhe_muscle_values, force_p, 80);
AT(mhe_muscle_values, rate_p, 88);
AT(mhe_muscle_values, fiber_length, 96);
AT(mhe_muscle_values, fiber_velocity, 104);
AT(mhe_muscle_values, pennation, 112);
AT(mhe_muscle_values, active, 120);
AT(mhe_muscle_values, passive, 128);

SIZE(mhe_muscle_ops, 56);
AT(mhe_muscle_ops, size, 0);
AT(mhe_muscle_ops, create, 8);
AT(mhe_muscle_ops, destroy, 16);
AT(mhe_muscle_ops, layout, 24);
AT(mhe_muscle_ops, evaluate, 32);
AT(mhe_muscle_ops, diagonal_rate, 40);
AT(mhe_muscle_ops, equilibrium, 48);

SIZE(mhe_force_layout, 104);
AT(mhe_force_layout, size, 0);
AT(mhe_force_layout, name, 8);
AT(mhe_force_layout, generalised, 16);
AT(mhe_force_layout, n_inputs, 20);
AT(mhe_force_layout, input_names, 24);
AT(mhe_force_layout, input_units, 32);
AT(mhe_force_layout, n_paths, 40);
AT(mhe_force_layout, paths, 48);
AT(mhe_force_layout, n_loads, 56);
AT(mhe_force_layout, loads, 64);
AT(mhe_force_layout, n_parameters, 72);
AT(mhe_force_layout, parameter_names, 80);
AT(mhe_force_layout, n_pairs, 88);
AT(mhe_force_layout, pairs, 96);

SIZE(mhe_frame_pair, 200);
AT(mhe_frame_pair, body, 0);
AT(mhe_frame_pair, r, 8);
AT(mhe_frame_pair, p, 152);

SIZE(mhe_force_point, 64);
AT(mhe_force_point, size, 0);
AT(mhe_force_point, q, 8);
AT(mhe_force_point, v, 16);
AT(mhe_force_point, length, 24);
AT(mhe_force_point, velocity, 32);
AT(mhe_force_point, input, 40);
AT(mhe_force_point, deflection, 48);
AT(mhe_force_point, deflection_rate, 56);

SIZE(mhe_force_values, 120);
AT(mhe_force_values, size, 0);
AT(mhe_force_values, tau, 8);
AT(mhe_force_values, tau_q, 16);
AT(mhe_force_values, tau_v, 24);
AT(mhe_force_values, tau_w, 32);
AT(mhe_force_values, tau_p, 40);
AT(mhe_force_values, tension, 48);
AT(mhe_force_values, tension_l, 56);
AT(mhe_force_values, tension_w, 64);
AT(mhe_force_values, tension_p, 72);
AT(mhe_force_values, load, 80);
AT(mhe_force_values, load_w, 88);
AT(mhe_force_values, push, 96);
AT(mhe_force_values, push_d, 104);
AT(mhe_force_values, push_w, 112);

SIZE(mhe_force_ops, 56);
AT(mhe_force_ops, size, 0);
AT(mhe_force_ops, create, 8);
AT(mhe_force_ops, destroy, 16);
AT(mhe_force_ops, layout, 24);
AT(mhe_force_ops, evaluate, 32);
AT(mhe_force_ops, input, 40);
AT(mhe_force_ops, covers, 48);

SIZE(mhe_system_point, 64);
AT(mhe_system_point, size, 0);
AT(mhe_system_point, q, 8);
AT(mhe_system_point, v, 16);
AT(mhe_system_point, a, 24);
AT(mhe_system_point, z, 32);
AT(mhe_system_point, c, 40);
AT(mhe_system_point, r, 48);
AT(mhe_system_point, w, 56);

SIZE(mhe_acceleration, 120);
AT(mhe_acceleration, size, 0);
AT(mhe_acceleration, vdot, 8);
AT(mhe_acceleration, vdot_q, 16);
AT(mhe_acceleration, vdot_v, 24);
AT(mhe_acceleration, vdot_a, 32);
AT(mhe_acceleration, vdot_r, 40);
AT(mhe_acceleration, vdot_z, 48);
AT(mhe_acceleration, vdot_p, 56);
AT(mhe_acceleration, zdot, 64);
AT(mhe_acceleration, zdot_q, 72);
AT(mhe_acceleration, zdot_v, 80);
AT(mhe_acceleration, zdot_a, 88);
AT(mhe_acceleration, zdot_c, 96);
AT(mhe_acceleration, zdot_z, 104);
AT(mhe_acceleration, zdot_p, 112);

SIZE(mhe_system, 112);
AT(mhe_system, size, 0);
AT(mhe_system, layout, 8);
AT(mhe_system, n_x, 16);
AT(mhe_system, n_u, 20);
AT(mhe_system, n_w, 24);
AT(mhe_system, n_p, 28);
AT(mhe_system, n_q, 32);
AT(mhe_system, n_m, 36);
AT(mhe_system, n_a, 40);
AT(mhe_system, n_d, 44);
AT(mhe_system, n_z, 48);
AT(mhe_system, n_r, 52);
AT(mhe_system, n_k, 56);
AT(mhe_system, first_d, 60);
AT(mhe_system, first_z, 64);
AT(mhe_system, z_muscle, 72);
AT(mhe_system, z_of, 80);
AT(mhe_system, data, 88);
AT(mhe_system, acceleration, 96);
AT(mhe_system, activation_rate, 104);

SIZE(mhe_step_derivatives, 32);
AT(mhe_step_derivatives, size, 0);
AT(mhe_step_derivatives, A, 8);
AT(mhe_step_derivatives, B, 16);
AT(mhe_step_derivatives, P, 24);

SIZE(mhe_integrator_ops, 64);
AT(mhe_integrator_ops, size, 0);
AT(mhe_integrator_ops, create, 8);
AT(mhe_integrator_ops, destroy, 16);
AT(mhe_integrator_ops, context_create, 24);
AT(mhe_integrator_ops, context_destroy, 32);
AT(mhe_integrator_ops, step, 40);
AT(mhe_integrator_ops, memory_size, 48);
AT(mhe_integrator_ops, accepts, 56);

SIZE(mhe_stage_values, 128);
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
AT(mhe_stage_values, P, 80);
AT(mhe_stage_values, grad_p, 88);
AT(mhe_stage_values, hess_px, 96);
AT(mhe_stage_values, hess_pu, 104);
AT(mhe_stage_values, hess_pp, 112);
AT(mhe_stage_values, hess_clear, 120);

SIZE(mhe_low_rank, 8);
AT(mhe_low_rank, size, 0);
AT(mhe_low_rank, n_directions, 4);

SIZE(mhe_stage_problem, 152);
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
AT(mhe_stage_problem, n_p, 112);
AT(mhe_stage_problem, p_lower, 120);
AT(mhe_stage_problem, p_upper, 128);
AT(mhe_stage_problem, set_parameters, 136);
AT(mhe_stage_problem, low_rank, 144);

SIZE(mhe_solution, 88);
AT(mhe_solution, size, 0);
AT(mhe_solution, has_multipliers, 4);
AT(mhe_solution, x, 8);
AT(mhe_solution, u, 16);
AT(mhe_solution, lambda, 24);
AT(mhe_solution, zx_lower, 32);
AT(mhe_solution, zx_upper, 40);
AT(mhe_solution, zu_lower, 48);
AT(mhe_solution, zu_upper, 56);
AT(mhe_solution, p, 64);
AT(mhe_solution, zp_lower, 72);
AT(mhe_solution, zp_upper, 80);

SIZE(mhe_covariance, 56);
AT(mhe_covariance, size, 0);
AT(mhe_covariance, node, 4);
AT(mhe_covariance, xx, 8);
AT(mhe_covariance, ux, 16);
AT(mhe_covariance, uu, 24);
AT(mhe_covariance, pp, 32);
AT(mhe_covariance, px, 40);
AT(mhe_covariance, pu, 48);

SIZE(mhe_solve_control, 64);
AT(mhe_solve_control, size, 0);
AT(mhe_solve_control, deadline, 8);
AT(mhe_solve_control, data, 16);
AT(mhe_solve_control, progress, 24);
AT(mhe_solve_control, budget, 32);
AT(mhe_solve_control, spent, 40);
AT(mhe_solve_control, late, 48);
AT(mhe_solve_control, one_step, 56);

SIZE(mhe_solve_info, 56);
AT(mhe_solve_info, size, 0);
AT(mhe_solve_info, outcome, 4);
AT(mhe_solve_info, iterations, 8);
AT(mhe_solve_info, objective, 16);
AT(mhe_solve_info, kkt_residual, 24);
AT(mhe_solve_info, primal_residual, 32);
AT(mhe_solve_info, evaluation_time, 40);
AT(mhe_solve_info, programs, 48);
AT(mhe_solve_info, fallbacks, 52);

SIZE(mhe_solver_ops, 56);
AT(mhe_solver_ops, size, 0);
AT(mhe_solver_ops, create, 8);
AT(mhe_solver_ops, destroy, 16);
AT(mhe_solver_ops, solve, 24);
AT(mhe_solver_ops, prepare, 32);
AT(mhe_solver_ops, accepts, 40);
AT(mhe_solver_ops, covariance, 48);
