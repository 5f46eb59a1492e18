/* Pinocchio in single precision, by its own algorithms for each term: M qd, C^T qd, g, and the frame's Jacobian. */
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

#include "peer.h"
#include "pinocchio_model.h"

namespace {

using Model = pinocchio::ModelTpl<float>;
using Data = pinocchio::DataTpl<float>;
using Placement = pinocchio::SE3Tpl<float>;
using Vector = Eigen::Matrix<float, Eigen::Dynamic, 1>;
using Rows3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Model model_of_table() {
    Model model;
    pinocchio::JointIndex parent = 0;
    for (const Link &link : LINKS) {
        const Placement placement(Eigen::Map<const Rows3>(link.rotation).cast<float>(),
                                  Eigen::Map<const Eigen::Vector3d>(link.position).cast<float>());
        const Eigen::Vector3f axis = Eigen::Map<const Eigen::Vector3d>(link.axis).cast<float>();
        pinocchio::JointModelTpl<float> joint = pinocchio::JointModelRevoluteUnalignedTpl<float>(axis);
        if (axis == Eigen::Vector3f::UnitX()) {
            joint = pinocchio::JointModelRevoluteTpl<float, 0, 0>();
        } else if (axis == Eigen::Vector3f::UnitY()) {
            joint = pinocchio::JointModelRevoluteTpl<float, 0, 1>();
        } else if (axis == Eigen::Vector3f::UnitZ()) {
            joint = pinocchio::JointModelRevoluteTpl<float, 0, 2>();
        }
        parent = model.addJoint(parent, joint, placement, "joint" + std::to_string(parent + 1));
        const pinocchio::InertiaTpl<float> body(static_cast<float>(link.mass),
                                                Eigen::Map<const Eigen::Vector3d>(link.com).cast<float>(),
                                                Eigen::Map<const Rows3>(link.inertia).cast<float>());
        model.appendBodyToJoint(parent, body, Placement::Identity());
    }
    const Placement tip(Eigen::Matrix3f::Identity(), Eigen::Map<const Eigen::Vector3d>(TIP).cast<float>());
    model.addFrame(pinocchio::FrameTpl<float>("tip", parent, tip, pinocchio::OP_FRAME));
    model.gravity.linear() = Eigen::Map<const Eigen::Vector3d>(GRAVITY).cast<float>();
    return model;
}

/* Constructed before main, so that the first state does not include it. */
const Model model = model_of_table();
Data data(model);
const pinocchio::FrameIndex tip = model.getFrameId("tip");
Eigen::Matrix<float, 6, Eigen::Dynamic> jacobian(6, model.nv);

} // namespace

void peer_pinocchio_terms(const float q_in[], const float qd_in[], float momentum[], float coriolis[], float gravity[],
                          float jacobian_out[]) {
    using Map = Eigen::Map<Vector>;
    const Eigen::Map<const Vector> q(q_in, model.nq), qd(qd_in, model.nv);

    pinocchio::crba(model, data, q);
    data.M.triangularView<Eigen::StrictlyLower>() = data.M.transpose().triangularView<Eigen::StrictlyLower>();
    Map(momentum, model.nv).noalias() = data.M * qd;
    pinocchio::computeCoriolisMatrix(model, data, q, qd); /* also computes data.J */
    Map(coriolis, model.nv).noalias() = data.C.transpose() * qd;
    Map(gravity, model.nv) = pinocchio::computeGeneralizedGravity(model, data, q);
    pinocchio::updateFramePlacement(model, data, tip);
    jacobian.setZero();
    pinocchio::getFrameJacobian(model, data, tip, pinocchio::LOCAL_WORLD_ALIGNED, jacobian);
    Eigen::Map<Eigen::Matrix<float, PEER_ROWS, PEER_STRIDE, Eigen::RowMajor>>(jacobian_out).leftCols<PEER_JOINTS>() =
        jacobian;
}
