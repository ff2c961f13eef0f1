/* SPDX-License-Identifier: Apache-2.0 */
/* public_models.h: the public OpenSim models that tests compare with OpenSim's own values, in
 * opensim/ of the reference data. */
#ifndef PUBLIC_MODELS_H
#define PUBLIC_MODELS_H

static const char *const public_models[] = {"arm26",
                                            "gait10dof18musc",
                                            "subject01_metabolics_path_spring",
                                            "gait2354_simbody",
                                            "gait2392_thelen2003muscle",
                                            "gait2392_millard2012muscle",
                                            "FullBodyModel_Hamner2010_v2_0",
                                            "leg39",
                                            "Rajagopal2016",
                                            "RajagopalLaiUhlrich2023",
                                            "wrist",
                                            "Tug_of_War_Millard",
                                            "MOBL_ARMS_41",
                                            "Wu_Shoulder_Model_via_points",
                                            "ThoracoscapularShoulderModel",
                                            "HYOID",
                                            "testMomentArmsConstraintA",
                                            "testMomentArmsConstraintB",
                                            "PathOnConstrainedBodyMomentArmTest",
                                            "MovingPathPointMomentArmTest",
                                            "MultipleMPPsMomentArmTest",
                                            "CoupledCoordinatesMPPsMomentArmTest",
                                            "WrapPathCustomJointMomentArmTest",
                                            "P2PBallJointMomentArmTest",
                                            "toyLigamentModel"};
#define N_PUBLIC_MODELS ((int)(sizeof public_models / sizeof public_models[0]))

#endif
