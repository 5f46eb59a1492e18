/* names: one prefix on every external symbol of the firmware. Written by tools/names2c; do not edit.
 *
 * The build includes this header before every file (-include names.h) of a library that other programs link. float32
 * and Q9.22 get different prefixes, so that both builds of the same sources fit into one program. tests/host hold that
 * no external symbol is left without a prefix.
 */
#ifndef TAUPERP_NAMES_H
#define TAUPERP_NAMES_H

#ifdef TAUPERP_FIXED
#define TAUPERP_INTERNAL(name) tauperp_fixed_##name
#else
#define TAUPERP_INTERNAL(name) tauperp_float_##name
#endif

/* core */
#define acceleration_init TAUPERP_INTERNAL(acceleration_init)
#define acceleration_step TAUPERP_INTERNAL(acceleration_step)
#define bank_init TAUPERP_INTERNAL(bank_init)
#define bank_step TAUPERP_INTERNAL(bank_step)
#define bidiagonal_diagonalise TAUPERP_INTERNAL(bidiagonal_diagonalise)
#define bidiagonal_rotate_back TAUPERP_INTERNAL(bidiagonal_rotate_back)
#define bidiagonal_square TAUPERP_INTERNAL(bidiagonal_square)
#define detector_init TAUPERP_INTERNAL(detector_init)
#define detector_step TAUPERP_INTERNAL(detector_step)
#define explained_init TAUPERP_INTERNAL(explained_init)
#define explained_step TAUPERP_INTERNAL(explained_step)
#define index_init TAUPERP_INTERNAL(index_init)
#define index_order TAUPERP_INTERNAL(index_order)
#define index_step TAUPERP_INTERNAL(index_step)
#define motion_init TAUPERP_INTERNAL(motion_init)
#define motion_step TAUPERP_INTERNAL(motion_step)
#define observer_init TAUPERP_INTERNAL(observer_init)
#define observer_step TAUPERP_INTERNAL(observer_step)
#define regressor_init TAUPERP_INTERNAL(regressor_init)
#define regressor_step TAUPERP_INTERNAL(regressor_step)
#define robot_holds TAUPERP_INTERNAL(robot_holds)
#define sensor_config_is_valid TAUPERP_INTERNAL(sensor_config_is_valid)
#define sensor_correct TAUPERP_INTERNAL(sensor_correct)
#define soft_init TAUPERP_INTERNAL(soft_init)
#define soft_reject TAUPERP_INTERNAL(soft_reject)
#define soft_step TAUPERP_INTERNAL(soft_step)
#define subspace_init TAUPERP_INTERNAL(subspace_init)
#define subspace_measure TAUPERP_INTERNAL(subspace_measure)
#define subspace_reject TAUPERP_INTERNAL(subspace_reject)
#define subspace_step TAUPERP_INTERNAL(subspace_step)

/* wire */
#define e2e_accepts TAUPERP_INTERNAL(e2e_accepts)
#define e2e_check TAUPERP_INTERNAL(e2e_check)
#define e2e_protect TAUPERP_INTERNAL(e2e_protect)
#define e2e_receiver_is_valid TAUPERP_INTERNAL(e2e_receiver_is_valid)
#define e2e_seal TAUPERP_INTERNAL(e2e_seal)
#define e2e_transmitter_is_valid TAUPERP_INTERNAL(e2e_transmitter_is_valid)

/* wire/generated */
#define guard_reason_name TAUPERP_INTERNAL(guard_reason_name)
#define guard_state_name TAUPERP_INTERNAL(guard_state_name)
#define protocol_receive TAUPERP_INTERNAL(protocol_receive)
#define protocol_slot TAUPERP_INTERNAL(protocol_slot)
#define protocol_transmit TAUPERP_INTERNAL(protocol_transmit)
#define reason_class_of TAUPERP_INTERNAL(reason_class_of)
#define tauperp_guard_event_pack TAUPERP_INTERNAL(tauperp_guard_event_pack)
#define tauperp_guard_index_pack TAUPERP_INTERNAL(tauperp_guard_index_pack)
#define tauperp_guard_reset_unpack TAUPERP_INTERNAL(tauperp_guard_reset_unpack)
#define tauperp_guard_status_pack TAUPERP_INTERNAL(tauperp_guard_status_pack)
#define tauperp_joint_state_unpack TAUPERP_INTERNAL(tauperp_joint_state_unpack)
#define tauperp_stop_command_pack TAUPERP_INTERNAL(tauperp_stop_command_pack)
#define tauperp_sync_unpack TAUPERP_INTERNAL(tauperp_sync_unpack)
#define tauperp_task_command_unpack TAUPERP_INTERNAL(tauperp_task_command_unpack)

/* guard */
#define config_bounds_check TAUPERP_INTERNAL(config_bounds_check)
#define config_check TAUPERP_INTERNAL(config_check)
#define config_reaction_us TAUPERP_INTERNAL(config_reaction_us)
#define config_watch_start TAUPERP_INTERNAL(config_watch_start)
#define config_watch_step TAUPERP_INTERNAL(config_watch_step)
#define crc32_fold TAUPERP_INTERNAL(crc32_fold)
#define event_log_frame TAUPERP_INTERNAL(event_log_frame)
#define event_log_init TAUPERP_INTERNAL(event_log_init)
#define event_log_note TAUPERP_INTERNAL(event_log_note)
#define guard_cycle_complete TAUPERP_INTERNAL(guard_cycle_complete)
#define guard_init TAUPERP_INTERNAL(guard_init)
#define guard_note_start TAUPERP_INTERNAL(guard_note_start)
#define guard_note_tick_time TAUPERP_INTERNAL(guard_note_tick_time)
#define guard_receive TAUPERP_INTERNAL(guard_receive)
#define guard_tick TAUPERP_INTERNAL(guard_tick)
#define guard_trip TAUPERP_INTERNAL(guard_trip)
#define note_fault TAUPERP_INTERNAL(note_fault)
#define plausibility_init TAUPERP_INTERNAL(plausibility_init)
#define plausibility_step TAUPERP_INTERNAL(plausibility_step)
#define reason_class TAUPERP_INTERNAL(reason_class)
#define reason_worse TAUPERP_INTERNAL(reason_worse)
#define report_init TAUPERP_INTERNAL(report_init)
#define report_tick TAUPERP_INTERNAL(report_tick)
#define rise_start TAUPERP_INTERNAL(rise_start)
#define rise_step TAUPERP_INTERNAL(rise_step)
#define self_test_step TAUPERP_INTERNAL(self_test_step)
#define snapshot_add TAUPERP_INTERNAL(snapshot_add)
#define snapshot_begin TAUPERP_INTERNAL(snapshot_begin)
#define snapshot_init TAUPERP_INTERNAL(snapshot_init)
#define snapshot_is_complete TAUPERP_INTERNAL(snapshot_is_complete)
#define snapshot_is_valid TAUPERP_INTERNAL(snapshot_is_valid)
#define snapshot_restart TAUPERP_INTERNAL(snapshot_restart)
#define snapshot_take TAUPERP_INTERNAL(snapshot_take)
#define stages_complete TAUPERP_INTERNAL(stages_complete)
#define stages_init TAUPERP_INTERNAL(stages_init)
#define stages_run TAUPERP_INTERNAL(stages_run)
#define stages_saturated TAUPERP_INTERNAL(stages_saturated)
#define stages_step TAUPERP_INTERNAL(stages_step)
#define stages_valid TAUPERP_INTERNAL(stages_valid)
#define supervise TAUPERP_INTERNAL(supervise)

/* schedule */
#define lockstep_complete TAUPERP_INTERNAL(lockstep_complete)
#define lockstep_hear TAUPERP_INTERNAL(lockstep_hear)
#define lockstep_owes_tick TAUPERP_INTERNAL(lockstep_owes_tick)
#define lockstep_silence TAUPERP_INTERNAL(lockstep_silence)
#define schedule_complete TAUPERP_INTERNAL(schedule_complete)
#define schedule_hear TAUPERP_INTERNAL(schedule_hear)
#define schedule_init TAUPERP_INTERNAL(schedule_init)
#define schedule_is_due TAUPERP_INTERNAL(schedule_is_due)
#define schedule_owes_tick TAUPERP_INTERNAL(schedule_owes_tick)
#define schedule_ticked TAUPERP_INTERNAL(schedule_ticked)
#define schedule_time TAUPERP_INTERNAL(schedule_time)

/* robot_side */
#define robot_side_begin TAUPERP_INTERNAL(robot_side_begin)
#define robot_side_follow TAUPERP_INTERNAL(robot_side_follow)
#define robot_side_has_company TAUPERP_INTERNAL(robot_side_has_company)
#define robot_side_hear TAUPERP_INTERNAL(robot_side_hear)
#define robot_side_init TAUPERP_INTERNAL(robot_side_init)
#define robot_side_joint TAUPERP_INTERNAL(robot_side_joint)
#define robot_side_permit TAUPERP_INTERNAL(robot_side_permit)
#define robot_side_reset TAUPERP_INTERNAL(robot_side_reset)
#define robot_side_task TAUPERP_INTERNAL(robot_side_task)

#endif
