/* SPDX-License-Identifier: Apache-2.0 */
/* instance.h: creates instances of plugins; an exception that a plugin throws becomes MHE_E_PLUGIN.
 * Messages of a failure begin with "<plugin id>: ". Where an interface asks whether a plugin
 * accepts its task, that is asked first. */
#ifndef MHI_INSTANCE_H
#define MHI_INSTANCE_H

#include <mhe/cost.h>
#include <mhe/force.h>
#include <mhe/host.h>
#include <mhe/integrator.h>
#include <mhe/model.h>
#include <mhe/muscle.h>
#include <mhe/solver.h>

/* The host without a voice: for a model that is made once more, of which the first has told all. */
mhe_host mhi_host_quiet(const mhe_host *host);

/* As create() of the plugin's own table, which the header of its interface describes. [cold] */
mhe_status mhi_model_create(const mhe_plugin *plugin, const mhe_host *host,
                            const mhe_description *description, const void *config, void **self,
                            mhe_error *err);
mhe_status mhi_muscle_create(const mhe_plugin *plugin, const mhe_host *host,
                             const mhe_muscle *muscles, int32_t n_muscles, const void *config,
                             void **self, mhe_muscle_layout *layout, mhe_error *err);
/* create(), then layout(); both here and of muscles. */
mhe_status mhi_force_create(const mhe_plugin *plugin, const mhe_host *host,
                            const mhe_description *description, const void *config, void **self,
                            mhe_force_layout *layout, mhe_error *err);
mhe_status mhi_integrator_create(const mhe_plugin *plugin, const mhe_host *host,
                                 const mhe_system *system, const void *config, void **self,
                                 mhe_error *err);
mhe_status mhi_solver_create(const mhe_plugin *plugin, const mhe_host *host,
                             const mhe_stage_problem *problem, const void *config, void **self,
                             mhe_error *err);
/* create() where the cost has one (`*self` stays NULL without), then layout(). */
mhe_status mhi_cost_create(const mhe_plugin *plugin, const mhe_host *host,
                           const mhe_problem *problem, const void *config, void **self,
                           mhe_cost_layout *layout, mhe_error *err);

#endif
