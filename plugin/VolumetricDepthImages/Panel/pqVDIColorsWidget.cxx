#include "pqVDIColorsWidget.h"

#include <pqActiveObjects.h>
#include <pqCoreUtilities.h>
#include <pqDataRepresentation.h>
#include <pqProxyWidgetDialog.h>
#include <pqUndoStack.h>
#include <pqView.h>
#include <vtkCommand.h>
#include <vtkSMProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMProxy.h>
#include <vtkSMSessionProxyManager.h>
#include <vtkSMTrace.h>
#include <QAbstractButton>
#include <QApplication>
#include <QCheckBox>
#include <QEvent>
#include <QLabel>
#include <QPushButton>
#include <QScreen>
#include <QTimer>
#include <QVBoxLayout>
#include <QWindow>

#include <algorithm>
#include <array>
#include <utility>

namespace {

/// Moves the dialog to where it hides as little of the active view as the screen allows: left, right, below
/// or above it. The dialog gets no higher than the space below the view's upper edge. Otherwise it would hide
/// the main window's menus and its own title bar. The window manager gives it a frame like the main window's.
void moveBesideView(QDialog* dialog) {
  pqView* active = pqActiveObjects::instance().activeView();
  const QWidget* widget = active != nullptr ? active->widget() : nullptr;
  const QWidget* main = pqCoreUtilities::mainWidget();
  if (widget == nullptr || main == nullptr || main->windowHandle() == nullptr) return;
  const QRect view(widget->mapToGlobal(QPoint(0, 0)), widget->size());
  const QRect room = main->windowHandle()->screen()->availableGeometry();
  const QSize frame = main->frameGeometry().size() - main->size();
  const int most = room.bottom() + 1 - view.top() - frame.height();
  if (most >= dialog->minimumSizeHint().height())
    dialog->resize(dialog->width(), std::min(dialog->height(), most));
  const QSize size = dialog->size() + frame;
  const auto inside = [&](int x, int y) {
    return QPoint(std::clamp(x, room.left(), std::max(room.left(), room.right() + 1 - size.width())),
                  std::clamp(y, room.top(), std::max(room.top(), room.bottom() + 1 - size.height())));
  };
  const std::array<QPoint, 4> places{
      inside(view.left() - size.width(), view.top()), inside(view.right() + 1, view.top()),
      inside(view.left(), view.bottom() + 1), inside(view.left(), view.top() - size.height())};
  const auto hidden = [&](const QPoint& place) {
    const QRect both = view.intersected(QRect(place, size));
    return both.isEmpty() ? 0 : both.width() * both.height();
  };
  dialog->move(*std::min_element(places.begin(), places.end(),
                                 [&](const QPoint& a, const QPoint& b) { return hidden(a) < hidden(b); }));
}

}  // namespace

pqVDIColorsWidget::pqVDIColorsWidget(vtkSMProxy* proxy, vtkSMProperty*, QWidget* parent)
    : pqPropertyWidget(proxy, parent),
      Button(new QPushButton(QIcon(":/pqWidgets/Icons/pqEditColor.svg"), tr("Edit Color Map and Opacity"),
                             this)),
      Line(new QLabel(tr("Show the VDI in the active view first."), this)) {
  this->setShowLabel(false);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  this->Button->setObjectName("EditColors");
  layout->addWidget(this->Button);
  this->Line->setWordWrap(true);
  this->Line->hide();
  layout->addWidget(this->Line);
  this->connect(this->Button, &QPushButton::clicked, this, &pqVDIColorsWidget::edit);
  pqCoreUtilities::connect(proxy->GetProperty("LookupTable"), vtkCommand::ModifiedEvent, this,
                           SLOT(mapChanged()));
  // Connects before the dialog exists, so that this runs before the dialog's own slots: ParaView's editor
  // assumes that the active view shows something.
  const pqActiveObjects& active = pqActiveObjects::instance();
  this->connect(&active, QOverload<pqDataRepresentation*>::of(&pqActiveObjects::representationChanged), this,
                &pqVDIColorsWidget::closeWhereNothingIsShown);
  this->connect(&active, QOverload<pqRepresentation*>::of(&pqActiveObjects::representationChanged), this,
                &pqVDIColorsWidget::closeWhereNothingIsShown);
  this->connect(&active, &pqActiveObjects::viewChanged, this, &pqVDIColorsWidget::closeWhereNothingIsShown);
  QApplication::instance()->installEventFilter(this);
  this->mapChanged();
}

pqVDIColorsWidget::~pqVDIColorsWidget() {
  this->endDrag();
  delete this->Dialog;
}

void pqVDIColorsWidget::mapChanged() {
  delete this->Dialog;
  const bool there = vtkSMPropertyHelper(this->proxy(), "LookupTable").GetAsProxy() != nullptr;
  this->Button->setEnabled(there);
  this->Button->setToolTip(there ? tr("The VDI is regenerated after each edit")
                                 : tr("The first Apply takes the map by which the view shows the volume"));
}

void pqVDIColorsWidget::closeWhereNothingIsShown() {
  if (pqActiveObjects::instance().activeRepresentation() == nullptr) delete this->Dialog;
}

/// Makes all edits of a drag one step for Undo. The editor applies, and records, each movement of the mouse.
bool pqVDIColorsWidget::eventFilter(QObject* watched, QEvent* event) {
  if (event->type() == QEvent::MouseButtonPress && !this->IsDragging && this->Dialog) {
    auto* widget = qobject_cast<QWidget*>(watched);
    // Buttons record steps of their own.
    if (widget != nullptr && widget->window() == this->Dialog &&
        qobject_cast<QAbstractButton*>(widget) == nullptr) {
      this->IsDragging = true;
      BEGIN_UNDO_SET(tr("Edit Color Map"));
    }
  } else if (event->type() == QEvent::MouseButtonRelease && this->IsDragging) {
    // The editor's widgets record a change soon after the event that made it.
    constexpr int recordedMilliseconds = 50;
    QTimer::singleShot(recordedMilliseconds, this, [this] {
      if (QApplication::mouseButtons() == Qt::NoButton) this->endDrag();
    });
  }
  return pqPropertyWidget::eventFilter(watched, event);
}

void pqVDIColorsWidget::endDrag() {
  if (!std::exchange(this->IsDragging, false)) return;
  END_UNDO_SET();
}

void pqVDIColorsWidget::keepMaps(vtkSMProxy* map) {
  this->Kept.clear();
  for (vtkSMProxy* each : {map, vtkSMPropertyHelper(map, "ScalarOpacityFunction", true).GetAsProxy(),
                           vtkSMPropertyHelper(this->proxy(), "ScalarOpacityFunction").GetAsProxy()}) {
    if (each == nullptr) continue;
    auto copy = vtkSmartPointer<vtkSMProxy>::Take(
        each->GetSessionProxyManager()->NewProxy(each->GetXMLGroup(), each->GetXMLName()));
    if (copy == nullptr) continue;
    copy->Copy(each);  // a copy on the client alone; it is never sent
    this->Kept.emplace_back(each, copy);
  }
}

/// Undoes the edits on Cancel, because the editor applies each at once.
void pqVDIColorsWidget::restore() {
  BEGIN_UNDO_SET(tr("Cancel Color Edits"));
  for (const auto& [map, copy] : this->Kept) {
    SM_SCOPED_TRACE(PropertiesModified).arg("proxy", map.Get());
    map->Copy(copy);
    map->UpdateVTKObjects();
  }
  END_UNDO_SET();
}

void pqVDIColorsWidget::edit() {
  vtkSMProxy* map = vtkSMPropertyHelper(this->proxy(), "LookupTable").GetAsProxy();
  if (map == nullptr) return;  // the button is disabled
  const bool shown = pqActiveObjects::instance().activeRepresentation() != nullptr;
  this->Line->setVisible(!shown);
  if (!shown) return;
  if (!this->Dialog) {
    auto* dialog = new pqProxyWidgetDialog(map, pqCoreUtilities::mainWidget());
    dialog->setObjectName("VDIColors");
    dialog->setWindowTitle(tr("Color Map and Opacity of the VDI"));
    dialog->setApplyChangesImmediately(true);
    dialog->setEnableSearchBar(true);
    dialog->setAttribute(Qt::WA_DeleteOnClose);
    // A VDI uses transfer functions of one value.
    if (auto* planar = dialog->findChild<QCheckBox*>("Use2DTransferFunction")) planar->hide();
    // Only the button takes edits back. The window's own ways to close a dialog keep them.
    if (auto* cancel = dialog->findChild<QPushButton*>("CancelButton"))
      this->connect(cancel, &QPushButton::clicked, this, &pqVDIColorsWidget::restore);
    this->keepMaps(map);
    this->Dialog = dialog;
    dialog->show();  // showing the dialog gives it its size
    moveBesideView(dialog);
  }
  this->Dialog->show();
  this->Dialog->raise();
}
