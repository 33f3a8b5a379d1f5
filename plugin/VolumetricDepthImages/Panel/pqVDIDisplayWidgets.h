// Makes the display panel hide properties without effect on a VDI, which has its lights and place already.
#ifndef pqVDIDisplayWidgets_h
#define pqVDIDisplayWidgets_h

#include <pqPropertyWidgetDecorator.h>
#include <pqPropertyWidgetInterface.h>
#include <QObject>

/// Hides a widget of the display panel while the representation is VDI.
class pqVDIHiddenDecorator : public pqPropertyWidgetDecorator {
  Q_OBJECT

 public:
  explicit pqVDIHiddenDecorator(pqPropertyWidget* parent);

  bool canShowWidget(bool showAdvanced) const override;
};

/// ParaView asks it for the decorators of each widget in its panels.
class pqVDIDisplayWidgets : public QObject, public pqPropertyWidgetInterface {
  Q_OBJECT
  Q_INTERFACES(pqPropertyWidgetInterface)

 public:
  explicit pqVDIDisplayWidgets(QObject* parent = nullptr);

  void createDefaultWidgetDecorators(pqPropertyWidget* widget) override;
};

#endif
