// Makes the VDI of one VolumetricDepthImage anew without making the window wait: after a colour map or
// opacity function was edited, from a view's camera, and by itself where the filter's Auto is on.
//
// While a map is being edited the filter is held: it shows what it has. Once the edit has rested and no mouse
// button is down, a thread makes the new VDI, which takes the old one's place when it's there. Likewise where
// a view asks for a VDI that isn't made yet, after Apply, Undo or with another time step: it goes on showing
// what it has, unless a picture is taken of it, an animation is played, or it is a comparative view.
#ifndef pqVDIRegenerator_h
#define pqVDIRegenerator_h

#include <pqView.h>
#include <QElapsedTimer>
#include <QList>
#include <QObject>
#include <QPointer>
#include <QTimer>

#include <array>
#include <vector>

class pqPipelineSource;
class pqProxy;
class vtkSMRenderViewProxy;
class vtkSMVDIGeneratorProxy;

class pqVDIRegenerator : public QObject {
  Q_OBJECT

 public:
  /// `source` is a VolumetricDepthImage; owns this.
  explicit pqVDIRegenerator(pqPipelineSource* source);
  ~pqVDIRegenerator() override;

  /// The panel is about to apply: the update that comes is for a view.
  void applies();
  /// From the camera of the view, at its size. The result is empty, or why that can't be.
  QString regenerate(pqView* view);
  /// That of a proxy, null if it's none of a VolumetricDepthImage in the pipeline.
  static pqVDIRegenerator* of(vtkSMVDIGeneratorProxy* proxy);
  /// The view whose camera Auto follows: the active one when Auto was turned on. Where that one didn't show
  /// the VDI, or has been closed, it's the first active one that does. Null if there has been none yet.
  pqView* autoView() const { return this->AutoView; }

 Q_SIGNALS:
  /// Percent of the VDI that's being made; -1: none is.
  void progress(int percent);
  void autoViewChanged();

 private:
  Q_SLOT void watchMaps();
  Q_SLOT void mapChanged();
  Q_SLOT void look();
  Q_SLOT void lookAtViews();
  Q_SLOT void autoChanged();
  Q_SLOT void leaveToUser();
  Q_SLOT void stateChanged();
  Q_SLOT void viewAdded(pqView* view);
  Q_SLOT void beginRender();
  Q_SLOT void endRender();
  Q_SLOT void lookWhetherViewsWait();
  Q_SLOT void proxyAdded(pqProxy* proxy);
  Q_SLOT void viewUpdated();

  enum class State { Idle, Waiting, Preparing };

  vtkSMVDIGeneratorProxy* generator() const;
  bool isShown() const;
  bool isShownIn(pqView* view) const;
  QList<pqView*> comparativeViews() const;
  void setAutoView(pqView* view);
  /// That of autoView, if it shows the VDI; null otherwise.
  vtkSMRenderViewProxy* followedView();
  int preparation();
  void hold(int restMilliseconds);
  void finish();
  void forgetMaps();

  pqPipelineSource* Source;
  State Now = State::Idle;
  QTimer Looking;         // while something is under way
  QTimer LookingAtViews;  // for Auto
  QElapsedTimer Resting;  // since the last edit
  qint64 Rest = 0;        // milliseconds that it has to
  bool IsAuto = false;    // as Auto was when it changed last
  QPointer<pqView> AutoView;
  std::array<double, 10> LastCamera{};
  bool Defers = false;      // views don't wait
  bool IsPlaying = false;   // an animation is
  bool IsCaptured = false;  // a picture is taken of a view
  bool Tried = false;       // to make a VDI from where the camera rests, or it's left to the user
  struct Watched;
  std::vector<Watched> Maps;
};

#endif
