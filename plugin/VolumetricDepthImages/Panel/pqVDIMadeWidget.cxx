#include "pqVDIMadeWidget.h"

#include <pqActiveObjects.h>
#include <pqCoreUtilities.h>
#include <pqUndoStack.h>
#include <pqView.h>
#include <vtkCommand.h>
#include <vtkSMProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMProxy.h>
#include <vtkSMRenderViewProxy.h>
#include <vtkSMTrace.h>
#include <QLabel>
#include <QPushButton>
#include <QStringList>
#include <QVBoxLayout>

#include <optional>

#include "VDIServer.h"
#include "VDIViewpoint.h"
#include "vdi/core/ComponentValues.h"
#include "vdi/core/Error.h"
#include "vdi/io/Metadata.h"
#include "vtkSMVDIGeneratorProxy.h"

namespace {

QString number(double value) {
  constexpr int digits = 6;
  return QString::number(value, 'g', digits);
}

QString point(const double* numbers) {
  return QString("(%1, %2, %3)").arg(number(numbers[0]), number(numbers[1]), number(numbers[2]));
}

/// The meaning of the VDI's colours; nullopt for files of older versions, which lack it.
std::optional<vdi::Coloring> coloringOf(vtkSMProxy* reader) {
  const char* said = vtkSMPropertyHelper(pv::asked(reader, "Coloring")).GetAsString();
  if (said == nullptr || *said == '\0') return std::nullopt;
  try {
    return vdi::io::coloringIn(said);
  } catch (const vdi::Error&) {
    return std::nullopt;  // from a server of another version
  }
}

QString nameOf(const vdi::ScalarArray& array) {
  QString name = QString::fromStdString(array.name);
  if (array.components < 2) return name;
  if (array.component == vdi::phase) return QObject::tr("%1, phase").arg(name);
  return array.component < 0 ? QObject::tr("%1, magnitude").arg(name)
                             : QObject::tr("%1, component %2").arg(name).arg(array.component);
}

QStringList linesOf(const vdi::Coloring& coloring) {
  QStringList lines;
  if (!coloring.array.name.empty()) {
    lines << QObject::tr("Array: %1 (%2)")
                 .arg(nameOf(coloring.array),
                      coloring.array.cells ? QObject::tr("cells") : QObject::tr("points"));
  }
  if (coloring.range.min <= coloring.range.max)
    lines << QObject::tr("Range: %1 to %2").arg(number(coloring.range.min), number(coloring.range.max));
  return lines;
}

QStringList linesOf(const pv::ViewpointNumbers& viewpoint) {
  const bool isParallel = viewpoint[10] != 0.0;
  return {QObject::tr("Seen from: %1").arg(point(viewpoint.data())),
          QObject::tr("Towards: %1").arg(point(&viewpoint[3])),
          isParallel ? QObject::tr("Parallel projection, scale %1").arg(number(viewpoint[11]))
                     : QObject::tr("View angle: %1 degrees").arg(number(viewpoint[9]))};
}

}  // namespace

pqVDIMadeWidget::pqVDIMadeWidget(vtkSMProxy* proxy, vtkSMProperty*, QWidget* parent)
    : pqPropertyWidget(proxy, parent),
      Text(new QLabel(this)),
      Button(new QPushButton(QIcon(":/VolumetricDepthImages/vdi.svg"), tr("Look as Made"), this)) {
  this->setShowLabel(false);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  this->Text->setObjectName("MadeText");
  this->Text->setWordWrap(true);
  this->Text->setTextInteractionFlags(Qt::TextSelectableByMouse);
  layout->addWidget(this->Text);
  this->Button->setObjectName("LookAsMade");
  this->Button->setToolTip(
      tr("Moves the camera of the active view to the viewpoint of the VDI, or of the first one of a series"));
  layout->addWidget(this->Button);
  this->connect(this->Button, &QPushButton::clicked, this, &pqVDIMadeWidget::lookAsMade);
  pqCoreUtilities::connect(proxy, vtkCommand::UpdateDataEvent, this, SLOT(read()));
  this->read();
}

pqVDIMadeWidget::~pqVDIMadeWidget() = default;

/// Shows what is known of the VDI: nothing before the first Apply, which reads it.
void pqVDIMadeWidget::read() {
  QStringList lines;
  if (const auto coloring = coloringOf(this->proxy())) lines << linesOf(*coloring);
  const auto viewpoint = pv::viewpointOf(this->proxy());
  if (viewpoint) lines << linesOf(*viewpoint);
  this->Text->setText(lines.join("\n"));
  this->Text->setVisible(!lines.isEmpty());
  this->Button->setEnabled(viewpoint.has_value());
}

void pqVDIMadeWidget::lookAsMade() {
  pqView* active = pqActiveObjects::instance().activeView();
  vtkSMRenderViewProxy* view =
      vtkSMVDIGeneratorProxy::RenderViewOf(active != nullptr ? active->getViewProxy() : nullptr);
  const auto viewpoint = pv::viewpointOf(this->proxy());
  if (view == nullptr || !viewpoint) return;
  BEGIN_UNDO_EXCLUDE();  // as ParaView's own buttons for the camera do
  {
    SM_SCOPED_TRACE(PropertiesModified).arg("proxy", view).arg("comment", "where the VDI was made from");
    pv::lookFrom(*viewpoint, view);
  }
  END_UNDO_EXCLUDE();
  active->render();
}
