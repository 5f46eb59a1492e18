/* The projections of eqs. 7, 14 and 20 by Eigen with fixed sizes, so that nothing is allocated. */
#include <Eigen/Dense>

#include "peer.h"

namespace {

template <int Columns> using Basis = Eigen::Matrix<float, PEER_JOINTS, Columns>;
using Torque = Eigen::Matrix<float, PEER_JOINTS, 1>;
using Jacobian = Eigen::Matrix<float, PEER_ROWS, PEER_STRIDE, Eigen::RowMajor>;
enum { PAYLOAD = 5, CONTACT = 6 };

Basis<PAYLOAD> payload_basis(const peer_task_t &task) {
    const auto jacobian = Eigen::Map<const Jacobian>(task.jacobian).leftCols<PEER_JOINTS>();
    const Eigen::Map<const Eigen::Vector3f> acceleration(task.acceleration), down(task.down);
    const auto linear = jacobian.topRows<3>();
    Basis<PAYLOAD> basis;
    basis.col(0).noalias() = linear.transpose() * down;
    const Eigen::Vector3f across = acceleration - acceleration.dot(down) * down;
    basis.col(1).noalias() = linear.transpose() * across;
    basis.rightCols<3>() = task.lever * jacobian.bottomRows<3>().transpose();
    return basis;
}

Basis<CONTACT> contact_basis(const peer_task_t &task) {
    const auto jacobian = Eigen::Map<const Jacobian>(task.jacobian).leftCols<PEER_JOINTS>();
    Basis<CONTACT> basis;
    basis.leftCols<3>() = jacobian.topRows<3>().transpose();
    basis.rightCols<3>() = task.lever * jacobian.bottomRows<3>().transpose();
    return basis;
}

/* r - U_r U_r^T r. Eigen computes a thin U only for a matrix with a dynamic number of columns. */
template <int Columns>
unsigned by_svd(const Basis<Columns> &basis, float tolerance, const float residual[], float rejected[],
                float singular[]) {
    using Matrix = Eigen::Matrix<float, PEER_JOINTS, Eigen::Dynamic, 0, PEER_JOINTS, Columns>;
    const Eigen::JacobiSVD<Matrix> svd(basis, Eigen::ComputeThinU);
    Eigen::Index rank = 0;
    for (Eigen::Index i = 0; i < Columns; ++i) {
        singular[i] = svd.singularValues()[i];
        rank += (singular[i] > tolerance) ? 1 : 0;
    }
    const Eigen::Map<const Torque> tau(residual);
    Eigen::Map<Torque> left(rejected);
    const auto explained = svd.matrixU().leftCols(rank);
    const Eigen::Matrix<float, Eigen::Dynamic, 1, 0, Columns, 1> along = explained.transpose().lazyProduct(tau);
    left = tau;
    left -= explained.lazyProduct(along);
    return static_cast<unsigned>(rank);
}

/* Q (0, 0; 0, 1) Q^T r, the rank by the diagonal of R. */
template <int Columns>
unsigned by_qr(const Basis<Columns> &basis, float tolerance, const float residual[], float rejected[]) {
    const Eigen::ColPivHouseholderQR<Basis<Columns>> qr(basis);
    Eigen::Index rank = 0;
    while ((rank < Columns) && (std::abs(qr.matrixQR()(rank, rank)) > tolerance)) {
        ++rank;
    }
    Torque left = Eigen::Map<const Torque>(residual);
    auto q = qr.householderQ();
    q.setLength(rank);
    left.applyOnTheLeft(q.adjoint());
    left.head(rank).setZero();
    left.applyOnTheLeft(q);
    Eigen::Map<Torque>{rejected} = left;
    return static_cast<unsigned>(rank);
}

} // namespace

unsigned peer_svd_project(const peer_task_t *task, const float residual[], float rejected[], float singular[]) {
    if (task->acceleration != nullptr) {
        return by_svd<PAYLOAD>(payload_basis(*task), task->tolerance, residual, rejected, singular);
    }
    return by_svd<CONTACT>(contact_basis(*task), task->tolerance, residual, rejected, singular);
}

unsigned peer_qr_project(const peer_task_t *task, const float residual[], float rejected[]) {
    if (task->acceleration != nullptr) {
        return by_qr<PAYLOAD>(payload_basis(*task), task->tolerance, residual, rejected);
    }
    return by_qr<CONTACT>(contact_basis(*task), task->tolerance, residual, rejected);
}
